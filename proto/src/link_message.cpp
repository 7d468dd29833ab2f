#include <array>

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
static_assert(static_cast<int>(RecordingAction::start) == v1::RECORDING_ACTION_START);
static_assert(static_cast<int>(RecordingAction::stop) == v1::RECORDING_ACTION_STOP);
static_assert(static_cast<int>(kEstimatorKinds.back()) == v1::EstimatorKind_MAX);

void write(const v1::LinkRequest& m, std::vector<std::byte>& out) {
  out.resize(m.ByteSizeLong());
  m.SerializeToArray(out.data(), static_cast<int>(out.size()));
}

void fill(const GetConfig&, v1::LinkRequest& m) { m.mutable_get_config(); }

void fill(const EstimatorUpdate& update, v1::LinkRequest& m) {
  fill_config(update, *m.mutable_set_config()->mutable_config()->mutable_estimator());
}

void fill(const ReportLux& report, v1::LinkRequest& m) {
  v1::ReportLuxRequest& request = *m.mutable_report_lux();
  request.set_lux(report.lux);
  request.set_normal_x(report.normal.x);
  request.set_normal_y(report.normal.y);
  request.set_normal_z(report.normal.z);
}

void fill(const GetCalibration&, v1::LinkRequest& m) { m.mutable_get_calibration(); }

void fill(RecordingAction action, v1::LinkRequest& m) {
  m.mutable_control_recording()->set_action(static_cast<v1::RecordingAction>(action));
}

v1::LinkRequest request_of(const LinkCommand& command) {
  v1::LinkRequest m;
  std::visit([&](const auto& c) { fill(c, m); }, command);
  return m;
}

/// The alternative of a LinkRequest or a LinkResponse: a message of ProbeService.
google::protobuf::Message& alternative(const LinkCommand& command, google::protobuf::Message& m) {
  constexpr std::array kNames = {"get_config", "set_config", "report_lux", "control_recording", "get_calibration"};
  return *m.GetReflection()->MutableMessage(&m, m.GetDescriptor()->FindFieldByName(kNames[command.index()]));
}

bool parse_response(std::span<const std::byte> bytes, google::protobuf::Message& m) {
  return bytes.size() <= kMaxLinkMessageBytes && m.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
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

LinkResponse response_of(const v1::LinkResponse& m) {
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
  if (m.has_control_recording()) out.recording = recording_from(m.control_recording().recording());
  if (m.has_get_calibration()) out.calibration = calibration_from(m.get_calibration());
  if (m.has_report_lux()) out.scale = m.report_lux().scale();
  return out;
}

}  // namespace

void encode_info_request(std::uint32_t id, std::vector<std::byte>& out) {
  v1::LinkRequest m;
  m.set_id(id);
  m.mutable_info();
  write(m, out);
}

void encode_plane_request(std::uint32_t id, std::vector<std::byte>& out) {
  v1::LinkRequest m;
  m.set_id(id);
  m.mutable_stream_plane();
  write(m, out);
}

void encode_link_request(std::uint32_t id, const LinkCommand& command, std::vector<std::byte>& out) {
  v1::LinkRequest m = request_of(command);
  m.set_id(id);
  write(m, out);
}

Result<LinkResponse> decode_link_response(std::span<const std::byte> bytes) {
  v1::LinkResponse m;
  if (!parse_response(bytes, m)) return Status(StatusCode::data_loss, "not a LinkResponse");
  return response_of(m);
}

std::string encode_rpc_request(const LinkCommand& command) {
  v1::LinkRequest m = request_of(command);
  return alternative(command, m).SerializeAsString();
}

Result<LinkResponse> decode_rpc_response(const LinkCommand& command, std::span<const std::byte> response) {
  v1::LinkResponse m;
  if (parse_response(response, alternative(command, m))) return response_of(m);
  return Status(StatusCode::data_loss,
                "the probe's response is not a message of proto/lightwell/v1/probe_service.proto");
}

}  // namespace lightwell
