#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <tuple>
#include <type_traits>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <lightwell/estimator_config.hpp>
#include <lightwell/text.hpp>

#include "field_names.hpp"
#include "messages.hpp"

namespace lightwell {
namespace {

namespace pb = google::protobuf;

/// An option of an estimator.
template <class Access, class Limits>
struct Option {
  std::string_view name;   ///< As in config.proto: "band", "panorama.epsilon".
  Access of;               ///< Its member of an EstimatorConfig or EstimatorUpdate.
  Limits allow;            ///< Whether a value is within its limits.
  std::string_view range;  ///< The limits of a number in words.

  /// The estimator that has it; empty: all.
  [[nodiscard]] std::string_view owner() const {
    const std::size_t dot = name.find('.');
    return name.substr(0, dot == std::string_view::npos ? 0 : dot);
  }
};
template <class Access, class Limits>
Option(std::string_view, Access, Limits, std::string_view) -> Option<Access, Limits>;

/// Limits of a number, both allowed.
constexpr auto within(int low, int high) {
  return [low, high](auto v) { return v >= low && v <= high; };
}
constexpr auto kFraction = [](double v) { return v >= 0 && v < 1; };
constexpr auto kEnvironmentEdge = [](int v) {
  return v == 0 || (v > 0 && is_environment_edge(static_cast<std::uint64_t>(v)));
};
constexpr std::string_view kEnvironmentEdges = "0, 8, 16, 32 or 64";

/// Every option.
constexpr auto kOptions = std::tuple{
    Option{"band", [](auto& c) -> decltype(auto) { return (c.band); }, within(0, 6), "0 to 6"},
    Option{"max_lights", [](auto& c) -> decltype(auto) { return (c.max_lights); }, within(0, 64), "0 to 64"},
    Option{"setting", [](auto& c) -> decltype(auto) { return (c.setting); },
           [](Setting v) { return v >= Setting::fast && v <= Setting::fastest; }, ""},
    Option{"panorama.light_threshold", [](auto& c) -> decltype(auto) { return (c.panorama.light_threshold); },
           [](double v) { return v >= 1.5 && std::isfinite(v); }, "at least 1.5 times the mean"},
    Option{"panorama.epsilon", [](auto& c) -> decltype(auto) { return (c.panorama.epsilon); }, kFraction,
           "0 to 1, 0.01 is 1 %"},
    Option{"panorama.radiance_epsilon", [](auto& c) -> decltype(auto) { return (c.panorama.radiance_epsilon); },
           kFraction, "0 to 1, 0.01 is 1 %"},
    Option{"panorama.unseen_fill", [](auto& c) -> decltype(auto) { return (c.panorama.unseen); },
           [](UnseenFill v) { return v >= UnseenFill::none && v <= UnseenFill::average; }, ""},
    Option{"panorama.smoothing", [](auto& c) -> decltype(auto) { return (c.panorama.smoothing); },
           [](Smoothing v) { return v >= Smoothing::none && v <= Smoothing::one_euro; }, ""},
    Option{"panorama.environment_edge", [](auto& c) -> decltype(auto) { return (c.panorama.environment_edge); },
           kEnvironmentEdge, kEnvironmentEdges},
    Option{"panorama.environment_rate", [](auto& c) -> decltype(auto) { return (c.panorama.environment_rate); },
           [](double v) { return v > 0 && std::isfinite(v); }, "positive and finite"},
    Option{"panorama.interleave", [](auto& c) -> decltype(auto) { return (c.panorama.interleave); },
           within(1, kMaxInterleave), "1 (every frame is read whole) to 16"},
    Option{"panorama.max_bytes", [](auto& c) -> decltype(auto) { return (c.panorama.max_bytes); },
           [](int v) { return v == 0 || v >= kMinMaxBytes; },
           "0 (no limit) or at least 96 bytes, of which the fields beside lights and bands take some 70"},
    Option{"marker.decimation", [](auto& c) -> decltype(auto) { return (c.marker.decimation); },
           [](double v) { return v == 0 || (v >= 1 && v <= 8); }, "0 (from the size of the tags) or 1 to 8"},
    Option{"marker.search_decimation", [](auto& c) -> decltype(auto) { return (c.marker.search_decimation); },
           within(1, 8), "1 to 8"},
    Option{"marker.max_faces", [](auto& c) -> decltype(auto) { return (c.marker.max_faces); },
           [](int v) { return v >= 0; }, "0 (all) or more"},
    Option{"specular.environment_edge", [](auto& c) -> decltype(auto) { return (c.specular.environment_edge); },
           kEnvironmentEdge, kEnvironmentEdges},
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

/// Looks up a field by the name of its option: the message that contains it, and its descriptor.
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

template <class Value>
std::string option_text(Value value, const pb::FieldDescriptor& f) {
  if constexpr (std::is_enum_v<Value>) {
    const pb::EnumValueDescriptor* const named = f.enum_type()->FindValueByNumber(static_cast<int>(value));
    return named == nullptr ? "unknown" : word_of(*named);
  } else {
    std::array<char, 32> text{};
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
  }
}

template <class Value>
Status parse_option(const pb::FieldDescriptor& f, std::string_view text, std::optional<Value>& out) {
  if constexpr (std::is_enum_v<Value>) {
    std::vector<std::string> words;
    for (int i = 1; i < f.enum_type()->value_count(); ++i) {
      words.push_back(word_of(*f.enum_type()->value(i)));
      if (words.back() != text) continue;
      out = static_cast<Value>(f.enum_type()->value(i)->number());
      return {};
    }
    return invalid_argument("one of " + joined(words));
  } else {
    constexpr bool kInteger = std::is_integral_v<Value>;
    const auto number = parse_number<std::conditional_t<kInteger, std::uint32_t, double>>(text);
    if (!number) return invalid_argument(kInteger ? "a whole number, 0 or more" : "a number");
    out = static_cast<Value>(*number);
    return {};
  }
}

}  // namespace

std::string_view to_string(EstimatorKind kind) {
  constexpr std::string_view kNames[] = {"unknown", "panorama", "marker", "specular"};
  const auto i = static_cast<std::size_t>(kind);
  return kNames[i < std::size(kNames) ? i : 0];
}

Status EstimatorConfig::validate() const {
  Status out;
  for_each_option([&](const auto& option) {
    const auto value = option.of(*this);
    if (!out.ok() || option.allow(value)) return;
    const std::string field = "estimator." + std::string(option.name);
    if constexpr (std::is_enum_v<decltype(value)>)
      out = invalid_argument(field + " is not known");
    else
      out = invalid_argument(field + " is " + std::to_string(value) + "; it must be " + std::string(option.range));
  });
  return out;
}

Status EstimatorConfig::validate(EstimatorKind kind) const {
  Status out = validate();
  const std::string name(to_string(kind));
  const EstimatorConfig usual;
  for_each_option([&](const auto& option) {
    const std::string owner(option.owner());
    if (!out.ok() || owner.empty() || owner == name || option.of(*this) == option.of(usual)) return;
    out = invalid_argument("estimator." + std::string(option.name) + ": the " + name +
                           " estimator, which is active, has no such option; the " + owner +
                           " estimator has it: leave it out, or run that estimator (lightwelld --estimator " + owner +
                           ")");
  });
  const std::span<const Setting> settings = settings_of(kind);
  if (out.ok() && std::ranges::find(settings, setting) == settings.end())
    out = invalid_argument("estimator.setting: the " + name + " estimator has no setting " +
                           std::string(to_string(setting)) + "; set " + std::string(to_string(settings.back())));
  return out;
}

std::span<const Setting> settings_of(EstimatorKind kind) {
  // The options of the other estimators do not form a single trade-off, so their settings make no difference.
  static constexpr std::array kOneSetting = {Setting::balanced};
  return kind == EstimatorKind::panorama ? std::span<const Setting>(kSettings) : kOneSetting;
}

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
  std::vector<ConfigField> out;
  v1::EstimatorConfig m;
  for_each_option([&](const auto& option) {
    if (!option.owner().empty() && option.owner() != to_string(estimator.kind)) return;
    const auto value = option.of(estimator.config);
    out.push_back({std::string(option.name), option_text(value, *find_field(m, option.name).second),
                   std::is_enum_v<decltype(value)> ? ConfigField::Type::word : ConfigField::Type::number});
  });
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
  const std::string current = current_option_name(name);
  std::vector<std::string> names;
  std::optional<Status> parsed;
  v1::EstimatorConfig m;
  for_each_option([&](const auto& option) {
    names.emplace_back(option.name);
    if (option.name == current) parsed = parse_option(*find_field(m, option.name).second, value, option.of(update));
  });
  if (!parsed) return invalid_argument("there is no field '" + current + "'" + nearest_name(current, names));
  if (parsed->ok()) return {};
  return invalid_argument(current + " is '" + std::string(value) + "'; it must be " + parsed->message());
}

}  // namespace lightwell
