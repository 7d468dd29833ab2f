#include "probe_requests.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <lightwell/probe_calls.hpp>
#include <lightwell/time.hpp>

#include "status_message.hpp"

namespace lightwell {
namespace {

/// The fields of a request that a running probe cannot change, by name.
std::string fixed_fields(const v1::Config& config) {
  std::vector<const google::protobuf::FieldDescriptor*> set;
  config.GetReflection()->ListFields(config, &set);
  std::string names;
  for (const auto* field : set)
    if (field->number() != v1::Config::kEstimatorFieldNumber) names += (names.empty() ? "" : ", ") + field->name();
  return names;
}

template <class Message>
Result<Message> parsed(std::string_view bytes) {
  Message m;
  if (m.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return m;
  return Status(StatusCode::data_loss, "the request is no message of proto/lightwell/v1/probe_service.proto");
}

}  // namespace

void answer_info(const StatusSnapshot& status, v1::InfoResponse& response) {
  fill_status(status, response);
  // Last, so that what came before does not sit between the clock and the wire.
  response.set_clock_now_ns(static_cast<std::uint64_t>(monotonic_now_ns()));
}

Status answer_set_config(const v1::Config& config, Commands& commands, v1::SetConfigResponse& response) {
  if (const std::string fixed = fixed_fields(config); !fixed.empty())
    return {StatusCode::failed_precondition,
            fixed +
                ": only `estimator` can change while the probe runs; put the rest into "
                "the configuration file and restart lightwelld"};
  if (!config.has_estimator()) return {StatusCode::invalid_argument, "no field is set"};
  // What the request leaves out stays as it is.
  const Result<UpdatedConfig> changed =
      updated_config(commands.estimator(), config.estimator().SerializeAsString(), commands.estimator_kind());
  if (!changed) return changed.status();
  for (const std::string& warning : changed->warnings) response.add_warnings(warning);
  return commands.set_estimator(changed->config);
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
      const auto asked = parsed<v1::InfoRequest>(request);
      if (!asked) return asked.status();
      v1::InfoResponse response;
      answer_info(commands.status(), response);
      return response.SerializeAsString();
    }
    case ProbeCall::set_config: {
      const auto asked = parsed<v1::SetConfigRequest>(request);
      if (!asked) return asked.status();
      v1::SetConfigResponse response;
      if (Status done = answer_set_config(asked->config(), commands, response); !done.ok()) return done;
      return response.SerializeAsString();
    }
    case ProbeCall::report_lux: {
      const auto asked = parsed<v1::ReportLuxRequest>(request);
      if (!asked) return asked.status();
      const Result<double> scale = answer_report_lux(*asked, commands);
      if (!scale) return scale.status();
      v1::ReportLuxResponse response;
      response.set_scale(*scale);
      return response.SerializeAsString();
    }
  }
  return Status(StatusCode::invalid_argument, "there is no such call");
}

}  // namespace lightwell
