#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <tuple>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <lightwell/config.hpp>

#include "config_message.hpp"
#include "text_message.hpp"

namespace lightwell {
namespace {

namespace pb = google::protobuf;

/// Visits each field; for EstimatorConfig and EstimatorUpdate.
constexpr auto kFields = std::tuple{
    [](auto& c) -> decltype(auto) { return (c.band); },
    [](auto& c) -> decltype(auto) { return (c.max_lights); },
    [](auto& c) -> decltype(auto) { return (c.setting); },
    [](auto& c) -> decltype(auto) { return (c.panorama.light_threshold); },
    [](auto& c) -> decltype(auto) { return (c.panorama.epsilon); },
    [](auto& c) -> decltype(auto) { return (c.panorama.radiance_epsilon); },
    [](auto& c) -> decltype(auto) { return (c.panorama.unseen); },
    [](auto& c) -> decltype(auto) { return (c.panorama.smoothing); },
    [](auto& c) -> decltype(auto) { return (c.panorama.environment_edge); },
    [](auto& c) -> decltype(auto) { return (c.panorama.environment_rate); },
    [](auto& c) -> decltype(auto) { return (c.marker.decimation); },
    [](auto& c) -> decltype(auto) { return (c.marker.search_decimation); },
    [](auto& c) -> decltype(auto) { return (c.marker.max_faces); },
};

template <class Visit>
void for_each_field(Visit&& visit) {
  std::apply([&](const auto&... field) { (visit(field), ...); }, kFields);
}

/// Enums of the value types are bytes: a number that is not an enumerator must not become one by truncation.
template <class Value>
Value known(int number, bool valid) {
  return valid ? static_cast<Value>(number) : Value{};
}

/// "UNSEEN_FILL_MIRROR" is "mirror".
std::string word_of(const pb::EnumValueDescriptor& value) {
  // The names of an enum's values have a common prefix, and the first of them is ..._UNSPECIFIED.
  const std::string& unspecified = value.type()->value(0)->name();
  std::string word = value.name().substr(unspecified.rfind('_') + 1);
  for (char& c : word) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return word;
}

/// Moves deprecated fields into the submessage that has a field of the same name and type, unless that is set. By
/// reflection, because the accessors of deprecated fields cause compiler warnings.
std::vector<std::string> move_deprecated(v1::EstimatorConfig& m, EstimatorKind kind) {
  std::vector<std::string> warnings;
  v1::PanoramaEstimatorConfig& to = *m.mutable_panorama();
  const pb::Reflection &from_fields = *m.GetReflection(), &to_fields = *to.GetReflection();
  std::vector<const pb::FieldDescriptor*> set;
  from_fields.ListFields(m, &set);
  for (const pb::FieldDescriptor* old : set) {
    if (!old->options().deprecated()) continue;
    const std::string& name = old->name();
    const pb::FieldDescriptor* now = to.GetDescriptor()->FindFieldByName(name);
    warnings.push_back(kind == EstimatorKind::panorama
                           ? "estimator." + name + " is deprecated; write estimator { panorama { " + name + " } }"
                           : "estimator." + name +
                                 " has no effect: it is an option of the panorama estimator, but the " +
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
  for_each_field([&](const auto& field) {
    if (field(update)) field(config) = *field(update);
  });
  return config;
}

EstimatorUpdate all_fields(const EstimatorConfig& config) {
  EstimatorUpdate out;
  for_each_field([&](const auto& field) { field(out) = field(config); });
  return out;
}

ReceivedUpdate update_of(v1::EstimatorConfig m, EstimatorKind kind) {
  ReceivedUpdate out{{}, move_deprecated(m, kind)};
  EstimatorUpdate& u = out.update;
  if (m.has_band()) u.band = static_cast<int>(m.band());
  if (m.has_max_lights()) u.max_lights = static_cast<int>(m.max_lights());
  if (m.has_setting()) u.setting = known<Setting>(m.setting(), v1::Setting_IsValid(m.setting()));
  const v1::PanoramaEstimatorConfig& p = m.panorama();
  if (p.has_light_threshold()) u.panorama.light_threshold = p.light_threshold();
  if (p.has_epsilon()) u.panorama.epsilon = p.epsilon();
  if (p.has_radiance_epsilon()) u.panorama.radiance_epsilon = p.radiance_epsilon();
  if (p.has_unseen()) u.panorama.unseen = known<UnseenFill>(p.unseen(), v1::UnseenFill_IsValid(p.unseen()));
  if (p.has_smoothing()) u.panorama.smoothing = known<Smoothing>(p.smoothing(), v1::Smoothing_IsValid(p.smoothing()));
  if (p.has_environment_edge()) u.panorama.environment_edge = static_cast<int>(p.environment_edge());
  if (p.has_environment_rate()) u.panorama.environment_rate = p.environment_rate();
  const v1::MarkerEstimatorConfig& marker = m.marker();
  if (marker.has_decimation()) u.marker.decimation = marker.decimation();
  if (marker.has_search_decimation()) u.marker.search_decimation = marker.search_decimation();
  if (marker.has_max_faces()) u.marker.max_faces = static_cast<int>(marker.max_faces());
  return out;
}

void fill_config(const EstimatorUpdate& update, v1::EstimatorConfig& m) {
  if (update.band) m.set_band(static_cast<std::uint32_t>(*update.band));
  if (update.max_lights) m.set_max_lights(static_cast<std::uint32_t>(*update.max_lights));
  if (update.setting) m.set_setting(static_cast<v1::Setting>(*update.setting));
  if (const EstimatorUpdate::Panorama& u = update.panorama; u != EstimatorUpdate::Panorama{}) {
    v1::PanoramaEstimatorConfig& p = *m.mutable_panorama();
    if (u.light_threshold) p.set_light_threshold(*u.light_threshold);
    if (u.epsilon) p.set_epsilon(*u.epsilon);
    if (u.radiance_epsilon) p.set_radiance_epsilon(*u.radiance_epsilon);
    if (u.unseen) p.set_unseen(static_cast<v1::UnseenFill>(*u.unseen));
    if (u.smoothing) p.set_smoothing(static_cast<v1::Smoothing>(*u.smoothing));
    if (u.environment_edge) p.set_environment_edge(static_cast<std::uint32_t>(*u.environment_edge));
    if (u.environment_rate) p.set_environment_rate(*u.environment_rate);
  }
  if (const EstimatorUpdate::Marker& u = update.marker; u != EstimatorUpdate::Marker{}) {
    v1::MarkerEstimatorConfig& marker = *m.mutable_marker();
    if (u.decimation) marker.set_decimation(*u.decimation);
    if (u.search_decimation) marker.set_search_decimation(*u.search_decimation);
    if (u.max_faces) marker.set_max_faces(static_cast<std::uint32_t>(*u.max_faces));
  }
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

Status set_field(EstimatorUpdate& update, std::string_view name, std::string_view value) {
  std::vector<std::string> names = option_names(EstimatorKind::panorama);
  std::ranges::copy(option_names(EstimatorKind::marker), std::back_inserter(names));
  if (std::ranges::find(names, name) == names.end())
    return {StatusCode::invalid_argument, "there is no field '" + std::string(name) + "'" + nearest_name(name, names)};
  v1::EstimatorConfig m;
  fill_config(update, m);
  const auto [in, field] = find_field(m, name);
  if (Status s = put(*in, *field, name, value); !s.ok()) return s;
  update = update_of(m, EstimatorKind::panorama).update;
  return {};
}

}  // namespace lightwell
