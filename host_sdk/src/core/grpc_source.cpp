// gRPC connection: one thread that receives from a probe and reconnects.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <grpcpp/alarm.h>
#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/impl/client_unary_call.h>
#include <grpcpp/impl/rpc_method.h>
#include <grpcpp/support/slice.h>

#include <lightwell/backoff.hpp>
#include <lightwell/codec.hpp>
#include <lightwell/link_message.hpp>

#include "core/credential_store.hpp"
#include "core/grpc_channel.hpp"
#include "core/source.hpp"

namespace lightwell::core {
namespace {

/// Round trips before the clock is used for the time stamps of descriptors.
constexpr int kRoundTripsBeforeStream = 2;

std::string method_path(const std::string& method) { return "/lightwell.v1.ProbeService/" + method; }

grpc::ByteBuffer buffer_of(const std::string& message) {
  const grpc::Slice slice(message);
  return {&slice, 1};
}

/// One connection to a probe, from the first request to its end: requests Info until the clock is known, then reads the
/// stream of descriptors, and that of the captured plane if wanted, and requests Info once a second. Everything runs on
/// the reader thread, which passes the completion queue's events on. The stream is a generic call, because that returns
/// the message's bytes; a generated stub would parse them. Destroy it only when drained().
class GrpcConnection {
 public:
  GrpcConnection(const std::shared_ptr<grpc::Channel>& channel, const ProbeOptions& options,
                 grpc::CompletionQueue& queue, DescriptorReceiver& receiver)
      : options_(options), queue_(queue), receiver_(receiver), generic_(channel), last_received_{monotonic_now_ns()} {
    request_info();
  }

  /// Handles an event of the queue with one of this object's tags (Op).
  void on_event(void* tag, bool ok) {
    const auto op = static_cast<Op>(reinterpret_cast<std::intptr_t>(tag));
    if (op == Op::info)
      on_info(ok);
    else if (op >= Op::plane_start)
      on_plane_event(op, ok);
    else
      on_stream_event(op, ok);
  }

  [[nodiscard]] HostTime next_due() const {
    const HostTime silent = last_received_ + options_.silence_limit;
    return info_pending_ || closing_ ? silent : std::min(silent, next_info_);
  }

  /// Does what is due at `now`; call it after every event and at next_due().
  void on_time(HostTime now) {
    if (closing_) return;
    if (now >= last_received_ + options_.silence_limit)
      close("no data from the probe within silence_limit");
    else if (!info_pending_ && now >= next_info_)
      request_info();
  }

  /// Starts closing: cancels pending operations.
  void close(const std::string& error) {
    if (closing_) return;
    closing_ = true;
    if (!error.empty()) receiver_.report_error(error);
    if (info_pending_) info_context_->TryCancel();
    if (stream_pending_) stream_context_.TryCancel();
    if (plane_pending_) plane_context_.TryCancel();
  }

  /// After close() or a lost connection: no more events follow.
  [[nodiscard]] bool drained() const { return closing_ && !info_pending_ && !stream_pending_ && !plane_pending_; }
  /// Whether the stream was started.
  [[nodiscard]] bool succeeded() const { return streaming_; }

 private:
  enum class Op : std::intptr_t {
    info = 1,
    start,
    write,
    read,
    finish,
    plane_start,
    plane_write,
    plane_read,
    plane_finish
  };
  static void* tag_of(Op op) { return reinterpret_cast<void*>(static_cast<std::intptr_t>(op)); }

  void request_info() {
    info_context_ = std::make_unique<grpc::ClientContext>();
    info_context_->set_deadline(deadline_after(options_.connect_timeout));
    info_call_ = generic_.PrepareUnaryCall(info_context_.get(), method_path("Info"), buffer_of({}), &queue_);
    info_pending_ = true;
    info_sent_ = {monotonic_now_ns()};
    info_call_->StartCall();
    info_call_->Finish(&info_response_, &info_status_, tag_of(Op::info));
  }

  void on_info(bool ok) {
    const HostTime now{monotonic_now_ns()};
    info_pending_ = false;
    next_info_ = now + kInfoPeriod;
    if (closing_) return;
    const Result<InfoAnswer> answer =
        ok && info_status_.ok() ? decode_info(bytes_of(info_response_, bytes_)) : status_of(info_status_);
    if (!answer) {
      // With a running stream, a lost response does not end the connection; only silence does.
      if (!streaming_) close(answer.status().message());
      return;
    }
    last_received_ = now;
    clock_.add(info_sent_, answer->clock_now, now);
    ++round_trips_;
    if (round_trips_ < kFirstRoundTrips) next_info_ = now + kFirstInfoPeriod;
    if (round_trips_ < kRoundTripsBeforeStream) {
      request_info();
      return;
    }
    receiver_.describe(probe_info(answer->status, clock_, now));
    if (streaming_) return;
    streaming_ = stream_pending_ = true;
    stream_ = generic_.PrepareCall(&stream_context_, method_path("StreamDescriptors"), &queue_);
    stream_->StartCall(tag_of(Op::start));
    if (options_.plane == PlaneReception::none) return;
    receiver_.restart_plane();
    plane_pending_ = true;
    plane_ = generic_.PrepareCall(&plane_context_, method_path("StreamPlane"), &queue_);
    plane_->StartCall(tag_of(Op::plane_start));
  }

  /// The connection outlives this stream, which firmware that is older than it does not have. It starts again with the
  /// next connection.
  void on_plane_event(Op op, bool ok) {
    if (op == Op::plane_finish) {
      plane_pending_ = false;
      if (closing_) return;
      const std::string why = plane_status_.error_message();
      if (plane_status_.error_code() == grpc::StatusCode::UNIMPLEMENTED)
        receiver_.report_error("the probe's firmware is older than this SDK and captures no planes; update lightwelld");
      else
        receiver_.report_error("the plane's stream ended: " + (why.empty() ? "the probe ended it" : why));
      return;
    }
    if (op == Op::plane_read && ok) {
      receiver_.receive_plane(bytes_of(plane_message_, bytes_), {monotonic_now_ns()});
      plane_message_.Clear();
    }
    if (!ok || closing_)
      plane_->Finish(&plane_status_, tag_of(Op::plane_finish));
    else if (op == Op::plane_start)
      plane_->Write(buffer_of({}), grpc::WriteOptions().set_last_message(), tag_of(Op::plane_write));
    else
      plane_->Read(&plane_message_, tag_of(Op::plane_read));
  }

  void on_stream_event(Op op, bool ok) {
    if (op == Op::finish) {
      stream_pending_ = false;
      // A message above gRPC's own limit (4 MiB) ends the stream before its length is known here.
      const std::string why = stream_status_.error_message();
      if (stream_status_.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED &&
          why.find("larger than max") != std::string::npos)
        receiver_.refuse_oversized(std::size_t{4} << 20);
      close(why.empty() ? "the probe ended the stream" : why);
      return;
    }
    if (op == Op::read && ok) take_message();
    if (!ok || closing_) {
      stream_->Finish(&stream_status_, tag_of(Op::finish));
    } else if (op == Op::start) {
      stream_->Write(buffer_of({}), grpc::WriteOptions().set_last_message(), tag_of(Op::write));
    } else {
      if (op == Op::write) receiver_.set_state(LinkState::connected);
      stream_->Read(&message_, tag_of(Op::read));
    }
  }

  void take_message() {
    const HostTime received{monotonic_now_ns()};
    if (message_.Length() > kMaxDescriptorBytes)
      receiver_.refuse_oversized(message_.Length());
    else
      receiver_.receive(bytes_of(message_, bytes_), received,
                        [&](const CaptureTime& time) { return clock_.mapped(time.mid_exposure, received); });
    message_.Clear();
    // Time spent in the application's callback does not count as silence of the probe.
    last_received_ = {monotonic_now_ns()};
  }

  const ProbeOptions& options_;
  grpc::CompletionQueue& queue_;
  DescriptorReceiver& receiver_;
  grpc::GenericStub generic_;

  std::unique_ptr<grpc::ClientContext> info_context_;
  std::unique_ptr<grpc::GenericClientAsyncResponseReader> info_call_;
  grpc::ByteBuffer info_response_;
  grpc::Status info_status_;
  HostTime info_sent_, next_info_;
  int round_trips_ = 0;

  grpc::ClientContext stream_context_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream_;
  grpc::ByteBuffer message_;
  grpc::Status stream_status_;
  std::vector<std::byte> bytes_;

  grpc::ClientContext plane_context_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> plane_;
  grpc::ByteBuffer plane_message_;
  grpc::Status plane_status_;

  ClockMap clock_;
  HostTime last_received_;
  bool info_pending_ = false, stream_pending_ = false, plane_pending_ = false;
  bool streaming_ = false, closing_ = false;
};

class GrpcSource final : public Source {
 public:
  GrpcSource(const GrpcAddress& address, const ProbeOptions& options, DescriptorReceiver& receiver)
      : Source(address.host_port),
        options_(options),
        credentials_(address.transport == Transport::tls ? tls_credentials(options.credentials)
                                                         : grpc::InsecureChannelCredentials()),
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

 private:
  /// Tag of the alarm of wake(); the tags of GrpcConnection start at 1.
  static constexpr void* kWake = nullptr;

  /// Makes a unary call. Runs on the caller's thread, which gRPC allows concurrently with the reader thread's calls on
  /// the same channel.
  [[nodiscard]] Result<LinkResponse> request(const LinkCommand& command) override {
    constexpr std::array kMethods = {"GetConfig", "SetConfig", "ReportLux", "ControlRecording", "GetCalibration"};
    const std::shared_ptr<grpc::Channel> channel = [this] {
      const std::lock_guard lock(channel_mutex_);
      return channel_;
    }();
    if (!channel) return Status(StatusCode::unavailable, name() + ": not connected yet");
    grpc::ClientContext context;
    context.set_deadline(deadline_after(options_.connect_timeout));
    grpc::ByteBuffer response;
    // As generated stubs do; the messages are encoded by `proto`.
    const grpc::Status ended =
        grpc::internal::BlockingUnaryCall(channel.get(),
                                          grpc::internal::RpcMethod(method_path(kMethods[command.index()]).c_str(),
                                                                    grpc::internal::RpcMethod::NORMAL_RPC),
                                          &context, buffer_of(encode_rpc_request(command)), &response);
    if (ended.error_code() == grpc::StatusCode::UNIMPLEMENTED)
      return std::holds_alternative<GetConfig>(command)
                 ? no_get_config()
                 : Status(StatusCode::failed_precondition,
                          name() + ": the probe's firmware is older than this SDK and does not have the call " +
                              kMethods[command.index()] + "; update lightwelld there");
    std::vector<std::byte> bytes;
    const Result<LinkResponse> answer =
        ended.ok() ? decode_rpc_response(command, bytes_of(response, bytes)) : status_of(ended);
    const Status status = answer ? answer->status : answer.status();
    return status.ok() ? answer : status.in(name());
  }

  void follow() {
    while (!stopping_) {
      receiver_.set_state(LinkState::connecting);
      if (run_connection()) backoff_.reset();
      if (stopping_) return;
      receiver_.set_state(LinkState::waiting);
      // Without a connection, the only event is the destructor's alarm.
      void* tag = nullptr;
      bool ok = false;
      queue_.AsyncNext(&tag, &ok, deadline_after(backoff_.next()));
    }
  }

  /// Runs one connection until its end; true if the stream was started.
  bool run_connection() {
    const std::shared_ptr<grpc::Channel> channel = new_channel(name(), credentials_, &stopping_);
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

Result<std::unique_ptr<Source>> make_source(const GrpcAddress& address, ProbeOptions options,
                                            DescriptorReceiver& receiver) {
  Result<ProbeCredentials> credentials = credentials_for(options.credentials, address);
  if (!credentials) return credentials.status();
  options.credentials = std::move(*credentials);
  return std::unique_ptr<Source>(std::make_unique<GrpcSource>(address, options, receiver));
}

}  // namespace lightwell::core
