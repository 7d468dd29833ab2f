#include "ar_viewer/scene_fields.hpp"

#include <cmath>
#include <filesystem>
#include <utility>

namespace lightwell::viewer {
namespace {

std::string text_of(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text;
}

std::string joined(const auto& names) {
  std::string all;
  for (const auto& name : names) {
    if (!all.empty()) all += ", ";
    all += name;
  }
  return all;
}

}  // namespace

std::string excerpt(const nlohmann::json& value) {
  constexpr std::size_t kLongest = 40;
  const std::string text = value.dump(-1, ' ', true);
  return text.size() <= kLongest ? text : text.substr(0, kLongest) + "...";
}

std::string path_beside(const std::string& folder, const std::string& path) {
  return std::filesystem::path(path).is_absolute() ? path : (std::filesystem::path(folder) / path).string();
}

std::string missing_file(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(path, error)
             ? std::string()
             : "there is no " + path + "; name an existing file, relative to the folder of the scene";
}

Fields::Fields(const nlohmann::json& object, std::string where, Status& status)
    : object_(object), where_(std::move(where)), status_(status) {
  if (status_.ok() && !object_.is_object())
    status_ = invalid_argument((where_.empty() ? "the scene" : "field " + where_) + ": it is " + excerpt(object_) +
                               "; write an object, {...}");
}

std::string Fields::path_of(const std::string& name) const { return where_.empty() ? name : where_ + "." + name; }

void Fields::fail(const std::string& name, const std::string& problem) {
  if (status_.ok()) status_ = invalid_argument("field " + path_of(name) + ": " + problem);
}

bool Fields::has(const char* name) const { return object_.is_object() && object_.contains(name); }

const nlohmann::json* Fields::member(const char* name) {
  known_.insert(name);
  return status_.ok() && has(name) ? &object_.at(name) : nullptr;
}

void Fields::require(const char* name) {
  if (!has(name)) fail(name, "it is missing; write it, as README.md of ar_viewer describes");
}

void Fields::read_numbers(const char* name, std::size_t count, Range range,
                          const std::function<void(std::size_t, double)>& take) {
  const nlohmann::json* value = member(name);
  if (value == nullptr) return;
  const auto refuse = [&](const std::string& field, const nlohmann::json& given) {
    fail(field,
         "it is " + excerpt(given) + "; write a number from " + text_of(range.least) + " to " + text_of(range.most));
  };
  if (count == 0) {
    if (!value->is_number() || !(value->get<double>() >= range.least && value->get<double>() <= range.most))
      return refuse(name, *value);
    return take(0, value->get<double>());
  }
  if (!value->is_array() || value->size() != count)
    return fail(name, "it is " + excerpt(*value) + "; write a list of " + std::to_string(count) + " numbers");
  for (std::size_t i = 0; i < count; ++i) {
    const nlohmann::json& element = (*value)[i];
    if (!element.is_number() || !(element.get<double>() >= range.least && element.get<double>() <= range.most))
      return refuse(std::string(name) + "[" + std::to_string(i) + "]", element);
    take(i, element.get<double>());
  }
}

void Fields::read(const char* name, double& value, Range range) {
  read_numbers(name, 0, range, [&](std::size_t, double v) { value = v; });
}
void Fields::read(const char* name, float& value, Range range) {
  read_numbers(name, 0, range, [&](std::size_t, double v) { value = static_cast<float>(v); });
}
void Fields::read(const char* name, int& value, Range range) {
  read_numbers(name, 0, range, [&](std::size_t, double v) {
    if (v != std::floor(v)) return fail(name, "it is " + text_of(v) + "; write a whole number");
    value = static_cast<int>(v);
  });
}
void Fields::read(const char* name, std::span<double> values, Range range) {
  read_numbers(name, values.size(), range, [&](std::size_t i, double v) { values[i] = v; });
}
void Fields::read(const char* name, std::span<float> values, Range range) {
  read_numbers(name, values.size(), range, [&](std::size_t i, double v) { values[i] = static_cast<float>(v); });
}

void Fields::read(const char* name, std::string& value) {
  const nlohmann::json* text = member(name);
  if (text == nullptr) return;
  if (!text->is_string() || text->get_ref<const std::string&>().empty())
    return fail(name, "it is " + excerpt(*text) + "; write a text that is not empty");
  value = text->get<std::string>();
}

void Fields::read_path(const char* name, const std::string& folder, std::string& value) {
  std::string text;
  read(name, text);
  if (text.empty()) return;
  value = path_beside(folder, text);
  if (std::string problem = missing_file(value); !problem.empty()) fail(name, problem);
}

void Fields::read(const char* name, Pose& value) {
  const nlohmann::json* pose = member(name);
  if (pose == nullptr) return;
  Fields fields(*pose, path_of(name), status_);
  std::array<double, 3> position{};
  std::array<double, 4> rotation{0, 0, 0, 1};
  fields.read("position", std::span<double>(position), kAnyLength);
  fields.read("rotation", std::span<double>(rotation), Range{-1e6, 1e6});
  fields.refuse_others();
  const Quat q{rotation[0], rotation[1], rotation[2], rotation[3]};
  if (!(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w > 0))
    fields.fail("rotation", "it is zero; write x, y, z, w, [0, 0, 0, 1] for none");
  value = {q.normalized(), {position[0], position[1], position[2]}};
}

std::optional<std::size_t> Fields::choice(const char* name, std::span<const std::string_view> names) {
  std::string text;
  read(name, text);
  if (text.empty()) return std::nullopt;
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == text) return i;
  fail(name, "'" + text + "' is not known; write one of " + joined(names));
  return std::nullopt;
}

void Fields::refuse_others() {
  if (!status_.ok()) return;
  for (const auto& [name, value] : object_.items())
    if (!known_.contains(name)) return fail(name, "it is not known here; remove it, or write one of " + joined(known_));
}

}  // namespace lightwell::viewer
