#include <lightwell/framing.hpp>
#include <lightwell/link_message.hpp>

#include "lightwell/v1/link_message.pb.h"
#include "messages.hpp"

namespace lightwell {
namespace {

// The numbers on the wire are those of StatusCode and of EstimatorKind.
static_assert(static_cast<int>(StatusCode::invalid_argument) == v1::LINK_CODE_INVALID_ARGUMENT);
static_assert(static_cast<int>(StatusCode::not_found) == v1::LINK_CODE_NOT_FOUND);
static_assert(static_cast<int>(StatusCode::data_loss) == v1::LINK_CODE_DATA_LOSS);
static_assert(static_cast<int>(StatusCode::failed_precondition) == v1::LINK_CODE_FAILED_PRECONDITION);
static_assert(static_cast<int>(StatusCode::unavailable) == v1::LINK_CODE_UNAVAILABLE);
static_assert(static_cast<int>(StatusCode::resource_exhausted) == v1::LINK_CODE_RESOURCE_EXHAUSTED);
static_assert(static_cast<int>(StatusCode::internal) == v1::LINK_CODE_INTERNAL);
static_assert(static_cast<int>(kEstimatorKinds.back()) == v1::EstimatorKind_MAX);

/// Writes a LinkRequest with this number into `out`; `fill` sets what is asked.
template <class Fill>
void encode_request(std::uint32_t id, std::vector<std::byte>& out, Fill fill) {
  v1::LinkRequest m;
  m.set_id(id);
  fill(m);
  out.resize(m.ByteSizeLong());
  m.SerializeToArray(out.data(), static_cast<int>(out.size()));
}

void fill_set_config(const EstimatorUpdate& update, v1::SetConfigRequest& request) {
  fill_config(update, *request.mutable_config()->mutable_estimator());
}

void fill_report_lux(double lux, Vec3d normal, v1::ReportLuxRequest& request) {
  request.set_lux(lux);
  request.set_normal_x(normal.x);
  request.set_normal_y(normal.y);
  request.set_normal_z(normal.z);
}

template <class Message>
bool parse_response(std::span<const std::byte> bytes, Message& m) {
  return bytes.size() <= kMaxLinkMessageBytes && m.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

Status not_a_response() {
  return {StatusCode::data_loss, "the probe's response is not a message of proto/lightwell/v1/probe_service.proto"};
}

/// data_loss if this version does not know the configuration.
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

}  // namespace

void encode_info_request(std::uint32_t id, std::vector<std::byte>& out) {
  encode_request(id, out, [](v1::LinkRequest& m) { m.mutable_info(); });
}

void encode_get_config_request(std::uint32_t id, std::vector<std::byte>& out) {
  encode_request(id, out, [](v1::LinkRequest& m) { m.mutable_get_config(); });
}

void encode_set_config_request(std::uint32_t id, const EstimatorUpdate& update, std::vector<std::byte>& out) {
  encode_request(id, out, [&](v1::LinkRequest& m) { fill_set_config(update, *m.mutable_set_config()); });
}

void encode_report_lux_request(std::uint32_t id, double lux, Vec3d normal, std::vector<std::byte>& out) {
  encode_request(id, out, [&](v1::LinkRequest& m) { fill_report_lux(lux, normal, *m.mutable_report_lux()); });
}

Result<LinkResponse> decode_link_response(std::span<const std::byte> bytes) {
  v1::LinkResponse m;
  if (!parse_response(bytes, m)) return Status(StatusCode::data_loss, "not a LinkResponse");
  LinkResponse out;
  out.id = m.id();
  if (m.code() != v1::LINK_CODE_OK) {
    // An unknown code of a later version is still an error.
    const bool known = v1::LinkCode_IsValid(m.code());
    out.status = Status(known ? static_cast<StatusCode>(m.code()) : StatusCode::internal, m.message());
    return out;
  }
  if (m.has_info()) out.info = InfoAnswer{status_of(m.info()), {static_cast<std::int64_t>(m.info().clock_now_ns())}};
  if (m.has_get_config() || m.set_config().has_now()) {
    const Result<EstimatorState> state = state_of(m.has_get_config() ? m.get_config() : m.set_config().now());
    if (state)
      out.estimator = *state;
    else
      out.status = state.status();
  }
  if (m.has_report_lux()) out.scale = m.report_lux().scale();
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
  v1::GetConfigResponse m;
  return parse_response(response, m) ? state_of(m) : not_a_response();
}

Result<std::optional<EstimatorState>> decode_set_config_response(std::span<const std::byte> response) {
  v1::SetConfigResponse m;
  if (!parse_response(response, m)) return not_a_response();
  if (!m.has_now()) return std::optional<EstimatorState>();
  const Result<EstimatorState> now = state_of(m.now());
  if (!now) return now.status();
  return std::optional(*now);
}

Result<double> decode_report_lux_response(std::span<const std::byte> response) {
  v1::ReportLuxResponse m;
  if (!parse_response(response, m)) return not_a_response();
  return m.scale();
}

}  // namespace lightwell
