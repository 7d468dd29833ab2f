#include <cmath>
#include <utility>

#include <google/protobuf/stubs/logging.h>

#include <lightwell/commands.hpp>
#include <lightwell/framing.hpp>
#include <lightwell/text.hpp>
#include <lightwell/time.hpp>

#include "lightwell/v1/link_message.pb.h"
#include "messages.hpp"

namespace lightwell {
namespace {

/// Names of the fields of a request that a running probe cannot change.
std::string fixed_fields(const v1::Config& config) {
  std::vector<const google::protobuf::FieldDescriptor*> set;
  config.GetReflection()->ListFields(config, &set);
  std::string names;
  for (const auto* field : set)
    if (field->number() != v1::Config::kEstimatorFieldNumber) names += (names.empty() ? "" : ", ") + field->name();
  return names;
}

/// Number of the first field that this version does not know (set by a newer client); 0 if there is none.
int unknown_field(const google::protobuf::Message& m) {
  const google::protobuf::Reflection& values = *m.GetReflection();
  if (const auto& unknown = values.GetUnknownFields(m); !unknown.empty()) return unknown.field(0).number();
  std::vector<const google::protobuf::FieldDescriptor*> set;
  values.ListFields(m, &set);
  for (const auto* field : set)
    if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE)
      if (const int number = unknown_field(values.GetMessage(m, field)); number != 0) return number;
  return 0;
}

void answer_info(const StatusSnapshot& status, v1::InfoResponse& response) {
  fill_status(status, response);
  // The clock is read last but for the truncation of long texts, so that the time of the other work does not count as
  // transmission delay.
  response.set_clock_now_ns(static_cast<std::uint64_t>(monotonic_now_ns()));
}

void answer_get_config(const Commands& commands, v1::GetConfigResponse& response) {
  response.set_kind(static_cast<v1::EstimatorKind>(commands.estimator_kind()));
  *response.mutable_estimator() = message_of(commands.estimator());
}

Status answer_set_config(const v1::Config& config, Commands& commands, v1::SetConfigResponse& response) {
  if (const std::string fixed = fixed_fields(config); !fixed.empty())
    return {StatusCode::failed_precondition,
            fixed +
                ": only `estimator` can change while the probe runs; change the rest in "
                "the configuration file and restart lightwelld"};
  if (!config.has_estimator()) return invalid_argument("no field is set");
  if (const int number = unknown_field(config.estimator()); number != 0)
    return invalid_argument("estimator has a field, number " + std::to_string(number) +
                            ", that this probe does not know; is its firmware older than the client?");
  // Fields that are not in the request keep their values.
  const ReceivedUpdate parsed_request = update_of(config.estimator(), commands.estimator_kind());
  for (const std::string& warning : parsed_request.warnings) response.add_warnings(warning);
  if (Status done = commands.update_estimator(parsed_request.update); !done.ok()) return done;
  answer_get_config(commands, *response.mutable_now());
  return {};
}

Result<double> answer_report_lux(const v1::ReportLuxRequest& request, Commands& commands) {
  const Vec3d normal = normalized(Vec3d{request.normal_x(), request.normal_y(), request.normal_z()});
  if (normal == Vec3d{}) return invalid_argument("the normal is zero or not finite");
  if (!(request.lux() > 0) || !std::isfinite(request.lux())) return invalid_argument("lux must be positive and finite");
  return commands.report_lux(request.lux(), normal);
}

Status answer_control_recording(const v1::ControlRecordingRequest& request, Commands& commands,
                                v1::ControlRecordingResponse& response) {
  if (request.action() != v1::RECORDING_ACTION_START && request.action() != v1::RECORDING_ACTION_STOP)
    return invalid_argument("action: it must be RECORDING_ACTION_START or RECORDING_ACTION_STOP");
  const Result<RecordingStatus> recording = commands.control_recording(static_cast<RecordingAction>(request.action()));
  if (recording) fill_recording(*recording, *response.mutable_recording());
  return recording.status();
}

/// Longer texts are truncated, so that the response keeps its size limit, whatever name a camera has.
constexpr std::size_t kMaxTextBytes = 1024;

Status answer(const v1::LinkRequest& request, Commands& commands, const StartPlaneStream& start_plane_stream,
              v1::LinkResponse& response) {
  switch (request.ask_case()) {
    case v1::LinkRequest::kInfo:
      answer_info(commands.status(), *response.mutable_info());
      return {};
    case v1::LinkRequest::kSetConfig: {
      Status done = answer_set_config(request.set_config().config(), commands, *response.mutable_set_config());
      if (!done.ok()) response.clear_set_config();
      return done;
    }
    case v1::LinkRequest::kReportLux: {
      const Result<double> scale = answer_report_lux(request.report_lux(), commands);
      if (scale) response.mutable_report_lux()->set_scale(*scale);
      return scale.status();
    }
    case v1::LinkRequest::kGetConfig:
      answer_get_config(commands, *response.mutable_get_config());
      return {};
    case v1::LinkRequest::kControlRecording: {
      Status done =
          answer_control_recording(request.control_recording(), commands, *response.mutable_control_recording());
      if (!done.ok()) response.clear_control_recording();
      return done;
    }
    case v1::LinkRequest::kGetCalibration:
      fill_calibration(commands.calibration(), *response.mutable_get_calibration());
      return {};
    case v1::LinkRequest::kAuthenticate:
      response.mutable_authenticate();
      return {};
    case v1::LinkRequest::kStreamPlane:
      if (start_plane_stream) return start_plane_stream();
      break;
    case v1::LinkRequest::ASK_NOT_SET:
      break;
  }
  return invalid_argument("this kind of request is not known to the probe; is its firmware older than the SDK?");
}

}  // namespace

Result<std::string> answer_probe_call(ProbeCall call, std::string_view request, Commands& commands) {
  // The requests and responses of ProbeService are the alternatives of LinkRequest and LinkResponse.
  constexpr const char* kNames[] = {"info",       "set_config",        "report_lux",
                                    "get_config", "control_recording", "get_calibration"};
  const auto alternative = [name = kNames[static_cast<std::size_t>(call)]](google::protobuf::Message& m) {
    return m.GetReflection()->MutableMessage(&m, m.GetDescriptor()->FindFieldByName(name));
  };
  v1::LinkRequest link_request;
  if (!alternative(link_request)->ParseFromArray(request.data(), static_cast<int>(request.size())))
    return Status(StatusCode::data_loss, "the request is not a message of proto/lightwell/v1/probe_service.proto");
  v1::LinkResponse response;
  if (Status done = answer(link_request, commands, {}, response); !done.ok()) return done;
  return alternative(response)->SerializeAsString();
}

Status answer_link_request(std::span<const std::byte> request, Commands& commands, std::vector<std::byte>& response,
                           const StartPlaneStream& start_plane_stream) {
  response.clear();
  v1::LinkRequest link_request;
  if (request.size() > kMaxLinkMessageBytes ||
      !link_request.ParseFromArray(request.data(), static_cast<int>(request.size())))
    return {StatusCode::data_loss, "not a LinkRequest"};
  v1::LinkResponse m;
  m.set_id(link_request.id());
  const Status done = answer(link_request, commands, start_plane_stream, m);
  // The numbers are equal: src/link_message.cpp asserts it.
  m.set_code(static_cast<v1::LinkCode>(done.code()));
  m.set_message(truncated(done.message(), kMaxTextBytes));
  if (m.has_info())
    for (std::string* text : {m.mutable_info()->mutable_probe_name(), m.mutable_info()->mutable_version(),
                              m.mutable_info()->mutable_camera()})
      *text = truncated(std::move(*text), kMaxTextBytes);
  response.resize(m.ByteSizeLong());
  m.SerializeToArray(response.data(), static_cast<int>(response.size()));
  return {};
}

std::optional<AuthenticateRequest> decode_authenticate(std::span<const std::byte> request) {
  v1::LinkRequest m;
  if (request.size() > kMaxLinkMessageBytes || !m.ParseFromArray(request.data(), static_cast<int>(request.size())) ||
      !m.has_authenticate())
    return std::nullopt;
  return AuthenticateRequest{m.id(), m.authenticate().token()};
}

void silence_protobuf_log() { google::protobuf::SetLogHandler(nullptr); }

}  // namespace lightwell
