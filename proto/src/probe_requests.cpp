#include "probe_requests.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <lightwell/framing.hpp>
#include <lightwell/probe_calls.hpp>
#include <lightwell/time.hpp>

#include "config_message.hpp"
#include "status_message.hpp"

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

Status no_message(const std::string& what) {
  return {StatusCode::data_loss, what + " is not a message of proto/lightwell/v1/probe_service.proto"};
}

template <class Message>
Result<Message> parsed(std::string_view request) {
  Message m;
  if (m.ParseFromArray(request.data(), static_cast<int>(request.size()))) return m;
  return no_message("the request");
}

template <class Message>
Result<Message> parsed(std::span<const std::byte> response) {
  Message m;
  if (response.size() <= kMaxLinkMessageBytes && m.ParseFromArray(response.data(), static_cast<int>(response.size())))
    return m;
  return no_message("the probe's response");
}

}  // namespace

void answer_info(const StatusSnapshot& status, v1::InfoResponse& response) {
  fill_status(status, response);
  // The clock is read last, so that the time of the other work does not count as transmission delay.
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
  if (!config.has_estimator()) return {StatusCode::invalid_argument, "no field is set"};
  if (const int number = unknown_field(config.estimator()); number != 0)
    return {StatusCode::invalid_argument,
            "estimator has a field, number " + std::to_string(number) +
                ", that this probe does not know; is its firmware older than the client?"};
  // Fields that are not in the request keep their values.
  const ReceivedUpdate parsed_request = update_of(config.estimator(), commands.estimator_kind());
  for (const std::string& warning : parsed_request.warnings) response.add_warnings(warning);
  if (Status done = commands.update_estimator(parsed_request.update); !done.ok()) return done;
  answer_get_config(commands, *response.mutable_now());
  return {};
}

Result<double> answer_report_lux(const v1::ReportLuxRequest& request, Commands& commands) {
  const Vec3d normal = normalized(Vec3d{request.normal_x(), request.normal_y(), request.normal_z()});
  if (normal == Vec3d{}) return Status(StatusCode::invalid_argument, "the normal is zero or not finite");
  if (!(request.lux() > 0) || !std::isfinite(request.lux()))
    return Status(StatusCode::invalid_argument, "lux must be positive and finite");
  return commands.report_lux(request.lux(), normal);
}

Result<std::string> answer_probe_call(ProbeCall call, std::string_view request, Commands& commands) {
  switch (call) {
    case ProbeCall::info: {
      const auto parsed_request = parsed<v1::InfoRequest>(request);
      if (!parsed_request) return parsed_request.status();
      v1::InfoResponse response;
      answer_info(commands.status(), response);
      return response.SerializeAsString();
    }
    case ProbeCall::set_config: {
      const auto parsed_request = parsed<v1::SetConfigRequest>(request);
      if (!parsed_request) return parsed_request.status();
      v1::SetConfigResponse response;
      if (Status done = answer_set_config(parsed_request->config(), commands, response); !done.ok()) return done;
      return response.SerializeAsString();
    }
    case ProbeCall::report_lux: {
      const auto parsed_request = parsed<v1::ReportLuxRequest>(request);
      if (!parsed_request) return parsed_request.status();
      const Result<double> scale = answer_report_lux(*parsed_request, commands);
      if (!scale) return scale.status();
      v1::ReportLuxResponse response;
      response.set_scale(*scale);
      return response.SerializeAsString();
    }
    case ProbeCall::get_config: {
      const auto parsed_request = parsed<v1::GetConfigRequest>(request);
      if (!parsed_request) return parsed_request.status();
      v1::GetConfigResponse response;
      answer_get_config(commands, response);
      return response.SerializeAsString();
    }
  }
  return Status(StatusCode::invalid_argument, "unknown call of ProbeService");
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

Result<EstimatorState> state_of(const v1::GetConfigResponse& response) {
  const auto unknown = [](const std::string& what) {
    return Status(StatusCode::data_loss, what + ", in the probe's configuration; is this SDK older than its firmware?");
  };
  if (response.kind() != v1::ESTIMATOR_KIND_PANORAMA && response.kind() != v1::ESTIMATOR_KIND_MARKER)
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
