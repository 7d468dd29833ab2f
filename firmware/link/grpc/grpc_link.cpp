#include "link/grpc/grpc_link.hpp"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>

#include <charconv>
#include <cmath>
#include <lightwell/time.hpp>
#include <mutex>
#include <string_view>

#include "lightwell/v1/probe_service.grpc.pb.h"
#include "link/grpc/descriptor_stream.hpp"

namespace lightwell {
namespace {

grpc::Status rpc_status(const Status& s) {
  switch (s.code()) {
    case StatusCode::ok: return grpc::Status::OK;
    case StatusCode::invalid_argument: return {grpc::StatusCode::INVALID_ARGUMENT, s.message()};
    case StatusCode::not_found: return {grpc::StatusCode::NOT_FOUND, s.message()};
    case StatusCode::data_loss: return {grpc::StatusCode::DATA_LOSS, s.message()};
    case StatusCode::failed_precondition: return {grpc::StatusCode::FAILED_PRECONDITION, s.message()};
    case StatusCode::unavailable: return {grpc::StatusCode::UNAVAILABLE, s.message()};
    case StatusCode::resource_exhausted: return {grpc::StatusCode::RESOURCE_EXHAUSTED, s.message()};
    case StatusCode::internal: break;
  }
  return {grpc::StatusCode::INTERNAL, s.message()};
}

/// The fields of a request that a running probe cannot change, by name.
std::string fixed_fields(const v1::Config& config) {
  std::string names;
  const auto add = [&](bool set, const char* name) {
    if (set) names += (names.empty() ? "" : ", ") + std::string(name);
  };
  add(!config.probe_name().empty(), "probe_name");
  add(config.has_camera(), "camera");
  add(!config.calibration().empty(), "calibration");
  add(config.has_grpc(), "grpc");
  add(config.has_record(), "record");
  add(config.budget_ms() != 0, "budget_ms");
  return names;
}

/// Descriptors go out as the bytes that the publisher made: both methods that send them are raw.
using Base = v1::ProbeService::WithRawCallbackMethod_StreamDescriptors<
    v1::ProbeService::WithRawCallbackMethod_GetDescriptor<v1::ProbeService::WithCallbackMethod_Info<
        v1::ProbeService::WithCallbackMethod_SetConfig<
            v1::ProbeService::WithCallbackMethod_ReportLux<v1::ProbeService::Service>>>>>;

class Service final : public Base {
 public:
  explicit Service(Commands& commands) : commands_(commands) {}

  void publish(const EncodedDescriptor& descriptor) {
    const grpc::Slice slice(descriptor->data(), descriptor->size());
    const grpc::ByteBuffer buffer(&slice, 1);
    {
      const std::lock_guard lock(newest_mutex_);
      newest_ = buffer;
      has_newest_ = true;
    }
    streams_.publish(buffer);
  }

  StreamClients& streams() { return streams_; }
  const StreamClients& streams() const { return streams_; }

  grpc::ServerWriteReactor<grpc::ByteBuffer>* StreamDescriptors(grpc::CallbackServerContext*,
                                                                const grpc::ByteBuffer*) override {
    return streams_.add();
  }

  grpc::ServerUnaryReactor* GetDescriptor(grpc::CallbackServerContext* context, const grpc::ByteBuffer*,
                                          grpc::ByteBuffer* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    const std::lock_guard lock(newest_mutex_);
    if (has_newest_) {
      *response = newest_;
      reactor->Finish(grpc::Status::OK);
    } else {
      reactor->Finish({grpc::StatusCode::UNAVAILABLE, "no descriptor yet: the camera has not given a frame"});
    }
    return reactor;
  }

  grpc::ServerUnaryReactor* Info(grpc::CallbackServerContext* context, const v1::InfoRequest*,
                                 v1::InfoResponse* response) override {
    const StatusSnapshot s = commands_.status();
    response->set_probe_name(s.probe_name);
    response->set_probe_id(s.probe_id);
    response->set_calibration_id(s.calibration_id);
    response->set_version(s.version);
    response->set_camera(s.camera);
    v1::Counters& c = *response->mutable_counters();
    c.set_frames(s.counters.frames);
    c.set_captures_dropped(s.counters.captures_dropped);
    c.set_brackets_incomplete(s.counters.brackets_incomplete);
    c.set_estimates(s.counters.estimates);
    c.set_estimates_failed(s.counters.estimates_failed);
    c.set_descriptors_coalesced(s.counters.descriptors_coalesced);
    c.set_clients(s.counters.clients);
    c.set_frames_recorded(s.counters.frames_recorded);
    c.set_recording_faults(s.counters.recording_faults);
    c.set_frames_lost(s.counters.frames_lost);
    c.set_setting_moves(s.counters.setting_moves);
    c.set_estimates_late(s.counters.estimates_late);
    c.set_estimates_late_at_fast(s.counters.estimates_late_at_fast);
    // Last, so that what came before does not sit between the clock and the wire.
    response->set_clock_now_ns(static_cast<std::uint64_t>(monotonic_now_ns()));
    return finished(context, {});
  }

  grpc::ServerUnaryReactor* SetConfig(grpc::CallbackServerContext* context, const v1::SetConfigRequest* request,
                                      v1::SetConfigResponse*) override {
    const v1::Config& config = request->config();
    if (const std::string fixed = fixed_fields(config); !fixed.empty())
      return finished(context, {StatusCode::failed_precondition,
                                fixed + ": only `estimator` can change while the probe runs; put the rest into the "
                                        "configuration file and restart lightwelld"});
    if (!config.has_estimator()) return finished(context, {StatusCode::invalid_argument, "no field is set"});
    // What the request leaves out stays as it is.
    const Result<EstimatorConfig> changed =
        updated_config(commands_.estimator(), config.estimator().SerializeAsString());
    return finished(context, changed ? commands_.set_estimator(*changed) : changed.status());
  }

  grpc::ServerUnaryReactor* ReportLux(grpc::CallbackServerContext* context, const v1::ReportLuxRequest* request,
                                      v1::ReportLuxResponse* response) override {
    const Vec3d normal = normalized(Vec3d{request->normal_x(), request->normal_y(), request->normal_z()});
    if (normal == Vec3d{}) return finished(context, {StatusCode::invalid_argument, "the normal is zero"});
    if (!(request->lux() > 0) || !std::isfinite(request->lux()))
      return finished(context, {StatusCode::invalid_argument, "lux must be positive and finite"});
    const Result<double> scale = commands_.report_lux(request->lux(), normal);
    if (scale) response->set_scale(*scale);
    return finished(context, scale.status());
  }

 private:
  static grpc::ServerUnaryReactor* finished(grpc::CallbackServerContext* context, const Status& status) {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    reactor->Finish(rpc_status(status));
    return reactor;
  }

  Commands& commands_;
  StreamClients streams_;
  std::mutex newest_mutex_;
  grpc::ByteBuffer newest_;
  bool has_newest_ = false;
};

/// gRPC itself would take port 443 where none is named, and 34463 for 99999.
bool is_host_and_port(std::string_view listen) {
  const std::size_t colon = listen.rfind(':');
  if (colon == std::string_view::npos || colon == 0) return false;
  unsigned port = 0;
  const char* const end = listen.data() + listen.size();
  const auto [stop, error] = std::from_chars(listen.data() + colon + 1, end, port);
  return error == std::errc() && stop == end && port <= 65535;
}

class GrpcLink final : public Link {
 public:
  GrpcLink(std::string listen, Commands& commands) : listen_(std::move(listen)), service_(commands) {}
  ~GrpcLink() override { stop(); }

  Status start() override {
    if (!is_host_and_port(listen_)) return refused();
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort(listen_, grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&service_);
    // Two daemons on one port would share its clients at random.
    builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
    // A client that vanished without a word is noticed and its stream ended.
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 10'000);
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 5'000);
    builder.SetMaxReceiveMessageSize(64 * 1024);
    server_ = builder.BuildAndStart();
    if (!server_ || port == 0) {
      server_.reset();
      return refused();
    }
    port_ = port;
    server_->GetHealthCheckService()->SetServingStatus("lightwell.v1.ProbeService", true);
    return {};
  }

  void publish(const EncodedDescriptor& descriptor) override { service_.publish(descriptor); }

  void stop() override {
    if (!server_) return;
    service_.streams().close();
    server_->Shutdown(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
    server_->Wait();
    server_.reset();
  }

  LinkCounters counters() const override { return service_.streams().counters(); }

  std::string address() const override {
    return "grpc://" + listen_.substr(0, listen_.rfind(':')) + ":" + std::to_string(port_);
  }

 private:
  [[nodiscard]] Status refused() const {
    return {StatusCode::resource_exhausted,
            "cannot listen on '" + listen_ +
                "': the address is malformed (HOST:PORT), not of this machine, or its port is in use by another "
                "program (find it with `ss -ltnp`); choose another with grpc.listen or --listen, port 0 takes any"};
  }

  std::string listen_;
  Service service_;
  std::unique_ptr<grpc::Server> server_;
  int port_ = 0;
};

}  // namespace

std::unique_ptr<Link> make_grpc_link(const std::string& listen, Commands& commands) {
  return std::make_unique<GrpcLink>(listen, commands);
}

}  // namespace lightwell
