#include <algorithm>
#include <cmath>

#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/util/message_differencer.h>

#include <lightwell/estimator_config.hpp>

#include "config_message.hpp"

namespace lightwell {
namespace {

namespace pb = google::protobuf;

Status refuse(const std::string& field, const std::string& value, const std::string& what) {
  return {StatusCode::invalid_argument, "estimator." + field + " is " + value + "; it must be " + what};
}

}  // namespace

std::string_view to_string(EstimatorKind kind) {
  switch (kind) {
    case EstimatorKind::panorama:
      return "panorama";
    case EstimatorKind::marker:
      return "marker";
  }
  return "unknown";
}

Status PanoramaEstimatorConfig::validate() const {
  if (!(light_threshold >= 1.5) || !std::isfinite(light_threshold))
    return refuse("panorama.light_threshold", std::to_string(light_threshold), "at least 1.5 times the mean");
  if (!(epsilon >= 0 && epsilon < 1)) return refuse("panorama.epsilon", std::to_string(epsilon), "0 to 1, 0.01 is 1 %");
  if (!(radiance_epsilon >= 0 && radiance_epsilon < 1))
    return refuse("panorama.radiance_epsilon", std::to_string(radiance_epsilon), "0 to 1, 0.01 is 1 %");
  if (unseen < UnseenFill::none || unseen > UnseenFill::average)
    return {StatusCode::invalid_argument, "estimator.panorama.unseen_fill is not known"};
  if (smoothing < Smoothing::none || smoothing > Smoothing::one_euro)
    return {StatusCode::invalid_argument, "estimator.panorama.smoothing is not known"};
  if (environment_edge != 0 && environment_edge != 8 && environment_edge != 16 && environment_edge != 32 &&
      environment_edge != 64)
    return refuse("panorama.environment_edge", std::to_string(environment_edge), "0, 8, 16, 32 or 64");
  if (!(environment_rate > 0) || !std::isfinite(environment_rate))
    return refuse("panorama.environment_rate", std::to_string(environment_rate), "positive and finite");
  return {};
}

Status MarkerEstimatorConfig::validate() const {
  if (!(decimation == 0 || (decimation >= 1 && decimation <= 8)))
    return refuse("marker.decimation", std::to_string(decimation), "0 (from the size of the tags) or 1 to 8");
  if (!(search_decimation >= 1 && search_decimation <= 8))
    return refuse("marker.search_decimation", std::to_string(search_decimation), "1 to 8");
  if (max_faces < 0) return refuse("marker.max_faces", std::to_string(max_faces), "0 (all) or more");
  return {};
}

Status EstimatorConfig::validate() const {
  if (band < 0 || band > 6) return refuse("band", std::to_string(band), "0 to 6");
  if (max_lights < 0 || max_lights > 64) return refuse("max_lights", std::to_string(max_lights), "0 to 64");
  if (to_string(setting) == "unknown") return {StatusCode::invalid_argument, "estimator.setting is not known"};
  if (Status s = panorama.validate(); !s.ok()) return s;
  return marker.validate();
}

Status EstimatorConfig::validate(EstimatorKind kind) const {
  if (Status s = validate(); !s.ok()) return s;
  const std::string name(to_string(kind));
  const v1::EstimatorConfig set = message_of(*this), usual = message_of({});
  const pb::Reflection& fields = *set.GetReflection();
  for (const EstimatorKind other : kEstimatorKinds) {
    if (other == kind) continue;
    const std::string owner(to_string(other));
    const pb::FieldDescriptor* section = set.GetDescriptor()->FindFieldByName(owner);
    const pb::Message &has = fields.GetMessage(set, section), &had = fields.GetMessage(usual, section);
    pb::util::MessageDifferencer differencer;
    std::vector<const pb::FieldDescriptor*> all;
    has.GetReflection()->ListFields(has, &all);
    for (const pb::FieldDescriptor* field : all)
      if (!differencer.CompareWithFields(has, had, {field}, {field}))
        return {StatusCode::invalid_argument,
                "estimator." + owner + "." + field->name() + ": the " + name +
                    " estimator, which is active, has no such option; the " + owner +
                    " estimator has it: leave it out, or run that estimator (lightwelld --estimator " + owner + ")"};
  }
  const std::span<const Setting> settings = settings_of(kind);
  if (std::ranges::find(settings, setting) == settings.end())
    return {StatusCode::invalid_argument, "estimator.setting: the " + name + " estimator has no setting " +
                                              std::string(to_string(setting)) + "; set " +
                                              std::string(to_string(settings.back()))};
  return {};
}

std::vector<std::string> option_names(EstimatorKind kind) {
  std::vector<std::string> out;
  const pb::Descriptor& all = *v1::EstimatorConfig::descriptor();
  for (int i = 0; i < all.field_count(); ++i) {
    const pb::FieldDescriptor& field = *all.field(i);
    if (const pb::Descriptor* section = field.message_type()) {
      if (field.name() != to_string(kind)) continue;
      for (int k = 0; k < section->field_count(); ++k) out.push_back(field.name() + "." + section->field(k)->name());
    } else if (!field.options().deprecated()) {
      out.push_back(field.name());
    }
  }
  return out;
}

std::span<const Setting> settings_of(EstimatorKind kind) {
  // The options of the marker estimator do not form a single trade-off, so its settings make no difference.
  const std::span<const Setting> all(kSettings);
  return kind == EstimatorKind::marker ? all.subspan(1, 1) : all;
}

}  // namespace lightwell
