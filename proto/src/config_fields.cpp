#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <tuple>
#include <type_traits>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <lightwell/estimator_config.hpp>

#include "config_message.hpp"
#include "nearest_name.hpp"
#include "renamed_fields.hpp"

namespace lightwell {
namespace {

namespace pb = google::protobuf;

/// An option of an estimator.
template <class Access>
struct Option {
  std::string_view name;  ///< As in option_names().
  Access of;              ///< Its member of an EstimatorConfig or EstimatorUpdate.
};
template <class Access>
Option(std::string_view, Access) -> Option<Access>;

/// Every option.
constexpr auto kOptions = std::tuple{
    Option{"band", [](auto& c) -> decltype(auto) { return (c.band); }},
    Option{"max_lights", [](auto& c) -> decltype(auto) { return (c.max_lights); }},
    Option{"setting", [](auto& c) -> decltype(auto) { return (c.setting); }},
    Option{"panorama.light_threshold", [](auto& c) -> decltype(auto) { return (c.panorama.light_threshold); }},
    Option{"panorama.epsilon", [](auto& c) -> decltype(auto) { return (c.panorama.epsilon); }},
    Option{"panorama.radiance_epsilon", [](auto& c) -> decltype(auto) { return (c.panorama.radiance_epsilon); }},
    Option{"panorama.unseen_fill", [](auto& c) -> decltype(auto) { return (c.panorama.unseen); }},
    Option{"panorama.smoothing", [](auto& c) -> decltype(auto) { return (c.panorama.smoothing); }},
    Option{"panorama.environment_edge", [](auto& c) -> decltype(auto) { return (c.panorama.environment_edge); }},
    Option{"panorama.environment_rate", [](auto& c) -> decltype(auto) { return (c.panorama.environment_rate); }},
    Option{"marker.decimation", [](auto& c) -> decltype(auto) { return (c.marker.decimation); }},
    Option{"marker.search_decimation", [](auto& c) -> decltype(auto) { return (c.marker.search_decimation); }},
    Option{"marker.max_faces", [](auto& c) -> decltype(auto) { return (c.marker.max_faces); }},
};

template <class Visit>
void for_each_option(Visit&& visit) {
  std::apply([&](const auto&... option) { (visit(option), ...); }, kOptions);
}

/// "UNSEEN_FILL_MIRROR" is "mirror".
std::string word_of(const pb::EnumValueDescriptor& value) {
  // The names of an enum's values have a common prefix, and the first of them is ..._UNSPECIFIED.
  const std::string& unspecified = value.type()->value(0)->name();
  std::string word = value.name().substr(unspecified.rfind('_') + 1);
  for (char& c : word) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return word;
}

/// Moves deprecated fields into the submessage that has a field of the same (or former) name and type, unless that is
/// set. By reflection, because the accessors of deprecated fields cause compiler warnings.
std::vector<std::string> move_deprecated(v1::EstimatorConfig& m, EstimatorKind kind) {
  std::vector<std::string> warnings;
  v1::PanoramaEstimatorConfig& to = *m.mutable_panorama();
  const pb::Reflection &from_fields = *m.GetReflection(), &to_fields = *to.GetReflection();
  std::vector<const pb::FieldDescriptor*> set;
  from_fields.ListFields(m, &set);
  for (const pb::FieldDescriptor* old : set) {
    if (!old->options().deprecated()) continue;
    const std::string& name = old->name();
    const pb::FieldDescriptor* now =
        to.GetDescriptor()->FindFieldByName(std::string(current_field_name(to.GetDescriptor()->full_name(), name)));
    warnings.push_back(
        kind == EstimatorKind::panorama
            ? "estimator." + name + " is deprecated; write estimator { panorama { " + now->name() + " } }"
            : "estimator." + name + " has no effect: it is an option of the panorama estimator, but the " +
                  std::string(to_string(kind)) + " estimator is active; leave it out");
    if (kind != EstimatorKind::panorama || to_fields.HasField(to, now)) continue;
    if (old->cpp_type() == pb::FieldDescriptor::CPPTYPE_DOUBLE)
      to_fields.SetDouble(&to, now, from_fields.GetDouble(m, old));
    else if (old->cpp_type() == pb::FieldDescriptor::CPPTYPE_ENUM)
      to_fields.SetEnumValue(&to, now, from_fields.GetEnumValue(m, old));
    else
      to_fields.SetUInt32(&to, now, from_fields.GetUInt32(m, old));
  }
  return warnings;
}

/// Looks up a field by its name in option_names(): the message that contains it, and its descriptor.
std::pair<pb::Message*, const pb::FieldDescriptor*> find_field(v1::EstimatorConfig& m, std::string_view name) {
  pb::Message* in = &m;
  if (const auto dot = name.find('.'); dot != std::string_view::npos) {
    const pb::FieldDescriptor* const section = m.GetDescriptor()->FindFieldByName(std::string(name.substr(0, dot)));
    in = m.GetReflection()->MutableMessage(&m, section);
    name.remove_prefix(dot + 1);
  }
  return {in, in->GetDescriptor()->FindFieldByName(std::string(name))};
}

template <class Value>
void read_option(const pb::Message& m, const pb::FieldDescriptor& f, Value& out) {
  const pb::Reflection& values = *m.GetReflection();
  if constexpr (std::is_enum_v<Value>) {
    // Enums of the value types are bytes: a number that is not an enumerator must not become one by truncation.
    const int number = values.GetEnumValue(m, &f);
    out = f.enum_type()->FindValueByNumber(number) == nullptr ? Value{} : static_cast<Value>(number);
  } else if constexpr (std::is_same_v<Value, int>) {
    out = static_cast<int>(values.GetUInt32(m, &f));
  } else {
    out = values.GetDouble(m, &f);
  }
}

template <class Value>
void write_option(Value value, pb::Message& m, const pb::FieldDescriptor& f) {
  const pb::Reflection& values = *m.GetReflection();
  if constexpr (std::is_enum_v<Value>)
    values.SetEnumValue(&m, &f, static_cast<int>(value));
  else if constexpr (std::is_same_v<Value, int>)
    values.SetUInt32(&m, &f, static_cast<std::uint32_t>(value));
  else
    values.SetDouble(&m, &f, value);
}

ConfigField field_of(v1::EstimatorConfig& all, const std::string& name) {
  const auto [m, f] = find_field(all, name);
  const pb::Reflection& values = *m->GetReflection();
  if (f->cpp_type() == pb::FieldDescriptor::CPPTYPE_ENUM)
    return {name, word_of(*values.GetEnum(*m, f)), ConfigField::Type::word};
  if (f->cpp_type() == pb::FieldDescriptor::CPPTYPE_UINT32) return {name, std::to_string(values.GetUInt32(*m, f))};
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), values.GetDouble(*m, f)).ptr;
  return {name, std::string(text.data(), end)};
}

Status bad_value(std::string_view name, std::string_view value, const std::string& what) {
  return {StatusCode::invalid_argument, std::string(name) + " is '" + std::string(value) + "'; it must be " + what};
}

template <class Number>
bool parse_number(std::string_view text, Number& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc() && end == text.data() + text.size();
}

Status put(pb::Message& m, const pb::FieldDescriptor& f, std::string_view name, std::string_view value) {
  const pb::Reflection& values = *m.GetReflection();
  switch (f.cpp_type()) {
    case pb::FieldDescriptor::CPPTYPE_ENUM: {
      std::string words;
      for (int i = 1; i < f.enum_type()->value_count(); ++i) {
        const std::string word = word_of(*f.enum_type()->value(i));
        words += (i == 1 ? "" : ", ") + word;
        if (word != value) continue;
        values.SetEnum(&m, &f, f.enum_type()->value(i));
        return {};
      }
      return bad_value(name, value, "one of " + words);
    }
    case pb::FieldDescriptor::CPPTYPE_DOUBLE: {
      double number = 0;
      if (!parse_number(value, number)) return bad_value(name, value, "a number");
      values.SetDouble(&m, &f, number);
      return {};
    }
    default: {
      std::uint32_t number = 0;
      if (!parse_number(value, number)) return bad_value(name, value, "a whole number, 0 or more");
      values.SetUInt32(&m, &f, number);
      return {};
    }
  }
}

}  // namespace

EstimatorConfig updated(EstimatorConfig config, const EstimatorUpdate& update) {
  for_each_option([&](const auto& option) {
    if (option.of(update)) option.of(config) = *option.of(update);
  });
  return config;
}

EstimatorUpdate all_fields(const EstimatorConfig& config) {
  EstimatorUpdate out;
  for_each_option([&](const auto& option) { option.of(out) = option.of(config); });
  return out;
}

ReceivedUpdate update_of(v1::EstimatorConfig m, EstimatorKind kind) {
  ReceivedUpdate out{{}, move_deprecated(m, kind)};
  for_each_option([&](const auto& option) {
    const auto [in, field] = find_field(m, option.name);
    if (in->GetReflection()->HasField(*in, field)) read_option(*in, *field, option.of(out.update).emplace());
  });
  return out;
}

void fill_config(const EstimatorUpdate& update, v1::EstimatorConfig& m) {
  for_each_option([&](const auto& option) {
    if (!option.of(update)) return;
    const auto [in, field] = find_field(m, option.name);
    write_option(*option.of(update), *in, *field);
  });
}

v1::EstimatorConfig message_of(const EstimatorConfig& config) {
  v1::EstimatorConfig m;
  fill_config(all_fields(config), m);
  return m;
}

std::vector<ConfigField> fields_of(const EstimatorState& estimator) {
  v1::EstimatorConfig all = message_of(estimator.config);
  std::vector<ConfigField> out;
  for (const std::string& name : option_names(estimator.kind)) out.push_back(field_of(all, name));
  return out;
}

std::string current_option_name(std::string_view name) {
  std::string out(name);
  const std::size_t dot = name.find('.');
  if (dot == std::string_view::npos) return out;
  const pb::FieldDescriptor* const section = v1::EstimatorConfig::descriptor()->FindFieldByName(out.substr(0, dot));
  if (section == nullptr || section->message_type() == nullptr) return out;
  return out.replace(dot + 1, std::string::npos,
                     current_field_name(section->message_type()->full_name(), name.substr(dot + 1)));
}

Status set_field(EstimatorUpdate& update, std::string_view name, std::string_view value) {
  const std::string option = current_option_name(name);
  std::vector<std::string> names;
  for (const EstimatorKind kind : kEstimatorKinds) std::ranges::copy(option_names(kind), std::back_inserter(names));
  if (std::ranges::find(names, option) == names.end())
    return {StatusCode::invalid_argument, "there is no field '" + option + "'" + nearest_name(option, names)};
  v1::EstimatorConfig m;
  fill_config(update, m);
  const auto [in, field] = find_field(m, option);
  if (Status s = put(*in, *field, option, value); !s.ok()) return s;
  update = update_of(m, EstimatorKind::panorama).update;
  return {};
}

}  // namespace lightwell
