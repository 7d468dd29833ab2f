#include "host_sdk/fake_probe.hpp"

#include <chrono>
#include <condition_variable>
#include <utility>

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_builder.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>
#include <grpcpp/support/slice.h>

#include <lightwell/time.hpp>

namespace lightwell::test {
namespace {

using Raw = v1::ProbeService::WithRawCallbackMethod_StreamDescriptors<v1::ProbeService::Service>;

/// Sends the scripted messages, then waits for the client to disconnect.
class Stream final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  explicit Stream(std::vector<std::string> script) : script_(std::move(script)) { send_next(); }

  void OnWriteDone(bool ok) override {
    if (ok) send_next();
  }
  void OnCancel() override { Finish(grpc::Status::CANCELLED); }
  void OnDone() override { delete this; }

 private:
  void send_next() {
    if (next_ == script_.size()) return;
    const grpc::Slice slice(script_[next_++]);
    message_ = grpc::ByteBuffer(&slice, 1);
    StartWrite(&message_);
  }

  std::vector<std::string> script_;
  std::size_t next_ = 0;
  grpc::ByteBuffer message_;
};

}  // namespace

class FakeProbe::Service final : public Raw {
 public:
  grpc::Status Info(grpc::ServerContext* context, const v1::InfoRequest*, v1::InfoResponse* response) override {
    std::unique_lock lock(mutex);
    while (answering == Answering::no && !context->IsCancelled()) changed.wait_for(lock, std::chrono::milliseconds(20));
    response->set_probe_name("fake");
    response->set_probe_id(7);
    response->set_calibration_id(9);
    response->set_version("0.0.1");
    response->set_camera("none");
    response->set_clock_now_ns(static_cast<std::uint64_t>(monotonic_now_ns() + clock_offset_ns));
    response->mutable_counters()->set_frames(1234);
    response->mutable_counters()->set_messages_refused(17);
    response->mutable_counters()->set_authentication_failures(18);
    response->mutable_counters()->set_client_list_faults(19);
    if (mounting) *response->mutable_mounting() = *mounting;
    return grpc::Status::OK;
  }

  grpc::ServerWriteReactor<grpc::ByteBuffer>* StreamDescriptors(grpc::CallbackServerContext*,
                                                                const grpc::ByteBuffer*) override {
    const std::lock_guard lock(mutex);
    return new Stream(script);  // deletes itself, as gRPC's reactors do
  }

  grpc::Status StreamPlane(grpc::ServerContext*, const v1::StreamPlaneRequest*,
                           grpc::ServerWriter<v1::PlaneUpdate>*) override {
    const std::lock_guard lock(mutex);
    return plane_end;
  }

  grpc::Status SetConfig(grpc::ServerContext*, const v1::SetConfigRequest* request,
                         v1::SetConfigResponse* response) override {
    const std::lock_guard lock(mutex);
    config = *request;
    if (firmware == Firmware::present) response->mutable_now()->set_kind(v1::ESTIMATOR_KIND_PANORAMA);
    return grpc::Status::OK;
  }

  grpc::Status GetConfig(grpc::ServerContext* context, const v1::GetConfigRequest* request,
                         v1::GetConfigResponse* response) override {
    const std::lock_guard lock(mutex);
    if (firmware == Firmware::old) return Raw::GetConfig(context, request, response);
    response->set_kind(v1::ESTIMATOR_KIND_PANORAMA);
    if (config) *response->mutable_estimator() = config->config().estimator();
    return grpc::Status::OK;
  }

  grpc::Status ReportLux(grpc::ServerContext*, const v1::ReportLuxRequest* request,
                         v1::ReportLuxResponse* response) override {
    const std::lock_guard lock(mutex);
    lux = *request;
    if (request->lux() < 1) return {grpc::StatusCode::FAILED_PRECONDITION, "it is too dark"};
    response->set_scale(2.5);
    return grpc::Status::OK;
  }

  mutable std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> script;
  std::int64_t clock_offset_ns = 0;
  std::optional<v1::Mounting> mounting;
  Answering answering = Answering::yes;
  Firmware firmware = Firmware::present;
  grpc::Status plane_end{grpc::StatusCode::UNIMPLEMENTED, {}};
  std::optional<v1::SetConfigRequest> config;
  std::optional<v1::ReportLuxRequest> lux;
};

FakeProbe::FakeProbe() : service_(std::make_unique<Service>()) { start(); }
FakeProbe::~FakeProbe() { stop(); }

void FakeProbe::start() {
  // The port of a stopped server may not be free at once.
  for (int attempt = 0; attempt < 200 && !server_; ++attempt) {
    grpc::ServerBuilder builder;
    int bound = 0;
    builder.AddListeningPort("127.0.0.1:" + std::to_string(port_), grpc::InsecureServerCredentials(), &bound);
    builder.RegisterService(service_.get());
    server_ = builder.BuildAndStart();
    if (server_) port_ = bound;
    if (!server_) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

void FakeProbe::stop() {
  if (!server_) return;
  server_->Shutdown(std::chrono::system_clock::now());
  server_->Wait();
  server_.reset();
}

std::string FakeProbe::uri() const { return "grpc://127.0.0.1:" + std::to_string(port_); }

void FakeProbe::set_script(std::vector<std::string> messages) {
  const std::lock_guard lock(service_->mutex);
  service_->script = std::move(messages);
}

void FakeProbe::set_clock_offset_ns(std::int64_t offset_ns) {
  const std::lock_guard lock(service_->mutex);
  service_->clock_offset_ns = offset_ns;
}

void FakeProbe::set_mounting(const v1::Mounting& mounting) {
  const std::lock_guard lock(service_->mutex);
  service_->mounting = mounting;
}

void FakeProbe::set_firmware(Firmware firmware) {
  const std::lock_guard lock(service_->mutex);
  service_->firmware = firmware;
}

void FakeProbe::set_plane_end(const grpc::Status& end) {
  const std::lock_guard lock(service_->mutex);
  service_->plane_end = end;
}

void FakeProbe::set_answering(Answering answering) {
  const std::lock_guard lock(service_->mutex);
  service_->answering = answering;
  service_->changed.notify_all();
}

std::optional<v1::SetConfigRequest> FakeProbe::last_config() const {
  const std::lock_guard lock(service_->mutex);
  return service_->config;
}

std::optional<v1::ReportLuxRequest> FakeProbe::last_lux() const {
  const std::lock_guard lock(service_->mutex);
  return service_->lux;
}

}  // namespace lightwell::test
