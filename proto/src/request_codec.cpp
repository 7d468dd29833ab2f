#include <string>

#include <lightwell/framing.hpp>
#include <lightwell/request_codec.hpp>

#include "config_message.hpp"
#include "request_message.hpp"

namespace lightwell {
namespace {

template <class Message>
Result<Message> parsed(std::span<const std::byte> response) {
  Message m;
  if (response.size() <= kMaxLinkMessageBytes && m.ParseFromArray(response.data(), static_cast<int>(response.size())))
    return m;
  return Status(StatusCode::data_loss,
                "the probe's response is not a message of proto/lightwell/v1/probe_service.proto");
}

static_assert(static_cast<int>(kEstimatorKinds.back()) == v1::EstimatorKind_MAX,
              "EstimatorKind has the same values in estimator_config.hpp and probe_service.proto");

}  // namespace

void fill_set_config(const EstimatorUpdate& update, v1::SetConfigRequest& request) {
  fill_config(update, *request.mutable_config()->mutable_estimator());
}

void fill_report_lux(double lux, Vec3d normal, v1::ReportLuxRequest& request) {
  request.set_lux(lux);
  request.set_normal_x(normal.x);
  request.set_normal_y(normal.y);
  request.set_normal_z(normal.z);
}

Result<EstimatorState> state_of(const v1::GetConfigResponse& response) {
  const auto unknown = [](const std::string& what) {
    return Status(StatusCode::data_loss, what + ", in the probe's configuration; is this SDK older than its firmware?");
  };
  if (response.kind() == v1::ESTIMATOR_KIND_UNSPECIFIED || !v1::EstimatorKind_IsValid(response.kind()))
    return unknown("the kind of estimator is not known");
  const auto kind = static_cast<EstimatorKind>(response.kind());
  EstimatorState out{kind, updated({}, update_of(response.estimator(), kind).update)};
  if (const Status s = out.config.validate(kind); !s.ok()) return unknown(s.message());
  return out;
}

std::string encode_set_config_request(const EstimatorUpdate& update) {
  v1::SetConfigRequest m;
  fill_set_config(update, m);
  return m.SerializeAsString();
}

std::string encode_report_lux_request(double lux, Vec3d normal) {
  v1::ReportLuxRequest m;
  fill_report_lux(lux, normal, m);
  return m.SerializeAsString();
}

Result<EstimatorState> decode_get_config_response(std::span<const std::byte> response) {
  const auto m = parsed<v1::GetConfigResponse>(response);
  if (!m) return m.status();
  return state_of(*m);
}

Result<std::optional<EstimatorState>> decode_set_config_response(std::span<const std::byte> response) {
  const auto m = parsed<v1::SetConfigResponse>(response);
  if (!m) return m.status();
  if (!m->has_now()) return std::optional<EstimatorState>();
  const Result<EstimatorState> now = state_of(m->now());
  if (!now) return now.status();
  return std::optional(*now);
}

Result<double> decode_report_lux_response(std::span<const std::byte> response) {
  const auto m = parsed<v1::ReportLuxResponse>(response);
  if (!m) return m.status();
  return m->scale();
}

}  // namespace lightwell
