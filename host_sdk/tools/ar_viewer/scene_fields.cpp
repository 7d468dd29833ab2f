#include "ar_viewer/scene_fields.hpp"

#include <cmath>
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

Fields::Fields(const nlohmann::json& object, std::string where, Status& status)
    : object_(object), where_(std::move(where)), status_(status) {
  if (status_.ok() && !object_.is_object())
    status_ = invalid_argument((where_.empty() ? "the scene" : where_) + ": must be an object, {...}");
}

std::string Fields::path_of(const std::string& name) const { return where_.empty() ? name : where_ + "." + name; }

void Fields::fail(const std::string& name, const std::string& problem) {
  if (status_.ok()) status_ = invalid_argument(path_of(name) + ": " + problem);
}

bool Fields::has(const char* name) const { return object_.is_object() && object_.contains(name); }

const nlohmann::json* Fields::member(const char* name) {
  known_.insert(name);
  return status_.ok() && has(name) ? &object_.at(name) : nullptr;
}

void Fields::require(const char* name) {
  if (!has(name)) fail(name, "is missing");
}

void Fields::read_numbers(const char* name, std::size_t count, Range range,
                          const std::function<void(std::size_t, double)>& take) {
  const nlohmann::json* value = member(name);
  if (value == nullptr) return;
  const std::string limits = ", " + text_of(range.least) + " to " + text_of(range.most);
  if (count == 0) {
    if (!value->is_number() || !(value->get<double>() >= range.least && value->get<double>() <= range.most))
      return fail(name, "must be a number" + limits);
    return take(0, value->get<double>());
  }
  if (!value->is_array() || value->size() != count)
    return fail(name, "must be a list of " + std::to_string(count) + " numbers");
  for (std::size_t i = 0; i < count; ++i) {
    const nlohmann::json& element = (*value)[i];
    if (!element.is_number() || !(element.get<double>() >= range.least && element.get<double>() <= range.most))
      return fail(std::string(name) + "[" + std::to_string(i) + "]", "must be a number" + limits);
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
    if (v != std::floor(v)) return fail(name, "must be a whole number");
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
  if (!text->is_string() || text->get_ref<const std::string&>().empty()) return fail(name, "must be a text, not empty");
  value = text->get<std::string>();
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
  if (!(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w > 0)) fields.fail("rotation", "must not be zero");
  value = {q.normalized(), {position[0], position[1], position[2]}};
}

std::optional<std::size_t> Fields::choice(const char* name, std::span<const std::string_view> names) {
  std::string text;
  read(name, text);
  if (text.empty()) return std::nullopt;
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == text) return i;
  fail(name, "'" + text + "' is not known; it is one of " + joined(names));
  return std::nullopt;
}

void Fields::refuse_others() {
  if (!status_.ok()) return;
  for (const auto& [name, value] : object_.items())
    if (!known_.contains(name)) return fail(name, "is not a field; the fields here are " + joined(known_));
}

}  // namespace lightwell::viewer
