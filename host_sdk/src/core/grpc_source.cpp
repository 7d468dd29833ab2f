// gRPC connection: one thread that receives from a probe and reconnects.
#include <atomic>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <utility>

#include <grpcpp/alarm.h>
#include <grpcpp/impl/client_unary_call.h>
#include <grpcpp/impl/rpc_method.h>
#include <grpcpp/support/slice.h>

#include <lightwell/backoff.hpp>
#include <lightwell/request_codec.hpp>

#include "core/credential_store.hpp"
#include "core/grpc_connection.hpp"
#include "core/grpc_credentials.hpp"
#include "core/grpc_wire.hpp"
#include "core/source.hpp"

namespace lightwell::core {
namespace {

class GrpcSource final : public Source {
 public:
  GrpcSource(const GrpcAddress& address, const ProbeOptions& options, DescriptorReceiver& receiver)
      : host_port_(address.host_port),
        options_(options),
        credentials_(address.transport == Transport::tls ? tls_credentials(options.credentials) : plain_credentials()),
        receiver_(receiver),
        backoff_(options.retry_min, options.retry_max, std::random_device{}()),
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

  Result<EstimatorState> estimator() override {
    const Result<Bytes> answer = call("GetConfig", {});
    return answer ? decoded(decode_get_config_response(*answer)) : answer.status();
  }

  Status change_estimator(const EstimatorUpdate& update) override {
    const Result<Bytes> answer = call("SetConfig", encode_set_config_request(update));
    if (!answer) return answer.status();
    const auto now = decoded(decode_set_config_response(*answer));
    return now ? check_change(host_port_, update, *now) : now.status();
  }

  Result<double> report_lux(double lux, Vec3f normal) override {
    const Result<Bytes> answer = call("ReportLux", encode_report_lux_request(lux, vec_cast<double>(normal)));
    return answer ? decoded(decode_report_lux_response(*answer)) : answer.status();
  }

 private:
  /// Tag of the alarm of wake(); the tags of GrpcConnection start at 1.
  static constexpr void* kWake = nullptr;

  using Bytes = std::vector<std::byte>;

  /// Makes a unary call and returns the response's bytes. Runs on the caller's thread, which gRPC allows concurrently
  /// with the reader thread's calls on the same channel.
  Result<Bytes> call(const std::string& method, const std::string& request) {
    const std::shared_ptr<grpc::Channel> channel = [this] {
      const std::lock_guard lock(channel_mutex_);
      return channel_;
    }();
    if (!channel) return Status(StatusCode::unavailable, host_port_ + ": not connected yet");
    const std::string path = "/lightwell.v1.ProbeService/" + method;
    grpc::ClientContext context;
    context.set_deadline(deadline_after(options_.connect_timeout));
    const grpc::Slice slice(request);
    const grpc::ByteBuffer request_buffer(&slice, 1);
    grpc::ByteBuffer response;
    // As generated stubs do; the messages are encoded by `proto`.
    const grpc::Status ended = grpc::internal::BlockingUnaryCall(
        channel.get(), grpc::internal::RpcMethod(path.c_str(), grpc::internal::RpcMethod::NORMAL_RPC), &context,
        request_buffer, &response);
    if (ended.error_code() == grpc::StatusCode::UNIMPLEMENTED && method == "GetConfig")
      return no_get_config(host_port_);
    if (const Status status = status_of(ended); !status.ok())
      return Status(status.code(), host_port_ + ": " + status.message());
    Bytes storage;
    (void)bytes_of(response, storage);
    return storage;
  }

  template <class T>
  Result<T> decoded(Result<T> answer) const {
    if (answer) return answer;
    return Status(answer.status().code(), host_port_ + ": " + answer.status().message());
  }

  void follow() {
    while (!stopping_) {
      receiver_.set_state(LinkState::connecting);
      if (run_connection()) backoff_.reset();
      if (stopping_) return;
      receiver_.set_state(LinkState::waiting);
      pause(backoff_.next());
    }
  }

  /// Runs one connection until its end; true if the stream was started.
  bool run_connection() {
    const std::shared_ptr<grpc::Channel> channel = new_channel(host_port_, credentials_, &stopping_);
    {
      const std::lock_guard lock(channel_mutex_);
      channel_ = channel;
    }
    GrpcConnection connection(channel, options_, queue_, receiver_);
    while (!connection.drained()) {
      const HostTime now{monotonic_now_ns()};
      // Cancelled calls end at once, so wait without a deadline.
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

  /// Waits; without a connection, the only event is the destructor's alarm.
  void pause(Duration duration) {
    void* tag = nullptr;
    bool ok = false;
    queue_.AsyncNext(&tag, &ok, deadline_after(duration));
  }

  const std::string host_port_;
  const ProbeOptions options_;
  const std::shared_ptr<grpc::ChannelCredentials> credentials_;
  DescriptorReceiver& receiver_;
  Backoff backoff_;
  grpc::CompletionQueue queue_;
  std::mutex channel_mutex_;
  std::shared_ptr<grpc::Channel> channel_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;  // last, because it uses all members above
};

}  // namespace

Result<std::unique_ptr<Source>> make_grpc_source(const GrpcAddress& address, ProbeOptions options,
                                                 DescriptorReceiver& receiver) {
  Result<ProbeCredentials> credentials = credentials_for(options.credentials, address);
  if (!credentials) return credentials.status();
  options.credentials = std::move(*credentials);
  return std::unique_ptr<Source>(std::make_unique<GrpcSource>(address, options, receiver));
}

}  // namespace lightwell::core
