// The network link: one thread that follows a probe and comes back to it.
#include <atomic>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <utility>

#include <grpcpp/alarm.h>

#include <lightwell/back_off.hpp>

#include "core/grpc_connection.hpp"
#include "core/grpc_credentials.hpp"
#include "core/grpc_wire.hpp"
#include "core/source.hpp"

namespace lightwell::core {
namespace {

class GrpcSource final : public Source {
 public:
  GrpcSource(const GrpcAddress& address, const ProbeOptions& options, Intake& intake)
      : host_port_(address.host_port),
        options_(options),
        credentials_(address.transport == Transport::tls ? tls_credentials(options.credentials) : plain_credentials()),
        intake_(intake),
        back_off_(options.retry_min, options.retry_max, std::random_device{}()),
        thread_([this] { follow(); }) {}

  ~GrpcSource() override {
    stopping_ = true;
    grpc::Alarm alarm;
    alarm.Set(&queue_, gpr_now(GPR_CLOCK_MONOTONIC), kWake);
    thread_.join();
    queue_.Shutdown();
    void* tag = nullptr;
    bool ok = false;
    while (queue_.Next(&tag, &ok)) {
    }
  }

  Status set_estimator(const EstimatorConfig& config) override {
    v1::SetConfigRequest request;
    if (!request.mutable_config()->mutable_estimator()->ParseFromString(encode_config(config)))
      return {StatusCode::internal, "the configuration does not fit its own message"};
    v1::SetConfigResponse response;
    return tell([&](v1::ProbeService::Stub& stub, grpc::ClientContext& context) {
      return stub.SetConfig(&context, request, &response);
    });
  }

  Result<double> report_lux(double lux, Vec3f normal) override {
    v1::ReportLuxRequest request;
    request.set_lux(lux);
    request.set_normal_x(static_cast<double>(normal.x));
    request.set_normal_y(static_cast<double>(normal.y));
    request.set_normal_z(static_cast<double>(normal.z));
    v1::ReportLuxResponse response;
    Status status = tell([&](v1::ProbeService::Stub& stub, grpc::ClientContext& context) {
      return stub.ReportLux(&context, request, &response);
    });
    if (!status.ok()) return status;
    return response.scale();
  }

 private:
  /// No operation's tag: those of GrpcConnection start at 1.
  static constexpr void* kWake = nullptr;

  /// Runs on the caller's thread; gRPC allows that beside the reader's calls on the same channel.
  template <class Call>
  Status tell(Call&& call) {
    const std::shared_ptr<grpc::Channel> channel = [this] {
      const std::lock_guard lock(channel_mutex_);
      return channel_;
    }();
    if (!channel) return {StatusCode::unavailable, host_port_ + ": not connected yet"};
    v1::ProbeService::Stub stub(channel);
    grpc::ClientContext context;
    context.set_deadline(deadline_after(options_.connect_timeout));
    const Status status = status_of(call(stub, context));
    return status.ok() ? status : Status(status.code(), host_port_ + ": " + status.message());
  }

  void follow() {
    while (!stopping_) {
      intake_.set_state(LinkState::connecting);
      if (converse()) back_off_.reset();
      if (stopping_) return;
      intake_.set_state(LinkState::waiting);
      pause(back_off_.next());
    }
  }

  /// One connection until its end; true where it got as far as the stream.
  bool converse() {
    const std::shared_ptr<grpc::Channel> channel = new_channel(host_port_, credentials_, &stopping_);
    {
      const std::lock_guard lock(channel_mutex_);
      channel_ = channel;
    }
    GrpcConnection connection(channel, options_, queue_, intake_);
    while (!connection.drained()) {
      const HostTime now{monotonic_now_ns()};
      // A cancelled call ends at once; meanwhile there is nothing else to be on time for.
      const Duration wait = std::max(connection.next_due() - now, Duration{1'000'000});
      void* tag = nullptr;
      bool ok = false;
      if (queue_.AsyncNext(&tag, &ok, deadline_after(wait)) == grpc::CompletionQueue::GOT_EVENT && tag != kWake)
        connection.on_event(tag, ok);
      if (stopping_) connection.close({});
      connection.on_time({monotonic_now_ns()});
    }
    return connection.succeeded();
  }

  /// Only the destructor's alarm can come while no connection lives.
  void pause(Duration duration) {
    void* tag = nullptr;
    bool ok = false;
    queue_.AsyncNext(&tag, &ok, deadline_after(duration));
  }

  const std::string host_port_;
  const ProbeOptions options_;
  const std::shared_ptr<grpc::ChannelCredentials> credentials_;
  Intake& intake_;
  BackOff back_off_;
  grpc::CompletionQueue queue_;
  std::mutex channel_mutex_;
  std::shared_ptr<grpc::Channel> channel_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace

std::unique_ptr<Source> make_grpc_source(const GrpcAddress& address, const ProbeOptions& options, Intake& intake) {
  return std::make_unique<GrpcSource>(address, options, intake);
}

}  // namespace lightwell::core
