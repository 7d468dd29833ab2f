// One gRPC connection to a probe, from the first request to its end.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>

#include <lightwell/probe.hpp>

#include "core/clock_map.hpp"
#include "core/descriptor_receiver.hpp"
#include "core/grpc_wire.hpp"

namespace lightwell::core {

/// Requests Info until the clock is known, then reads the stream of descriptors and requests Info once a second.
/// Everything runs on the reader thread, which passes the completion queue's events on. The stream is a generic call,
/// because that returns the message's bytes; a generated stub would parse them. Destroy it only when drained().
class GrpcConnection {
 public:
  GrpcConnection(std::shared_ptr<grpc::Channel> channel, const ProbeOptions& options, grpc::CompletionQueue& queue,
                 DescriptorReceiver& receiver);

  /// Handles an event of the queue with one of this object's tags (Op).
  void on_event(void* tag, bool ok);
  /// Does what is due at `now`; call it after every event and at next_due().
  void on_time(HostTime now);
  [[nodiscard]] HostTime next_due() const;

  /// Starts closing: cancels pending operations.
  void close(const std::string& error);
  /// After close() or a lost connection: no more events follow.
  [[nodiscard]] bool drained() const { return closing_ && !info_pending_ && !stream_pending_; }
  /// Whether the stream was started.
  [[nodiscard]] bool succeeded() const { return streaming_; }

 private:
  enum class Op : std::intptr_t { info = 1, start, write, read, finish };
  static void* tag_of(Op op) { return reinterpret_cast<void*>(static_cast<std::intptr_t>(op)); }

  void request_info();
  void on_info(bool ok);
  void start_stream();
  void on_stream_event(Op op, bool ok);
  void take_message();
  void finish_stream();

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

  ClockMap clock_;
  HostTime last_received_;
  bool info_pending_ = false, stream_pending_ = false;
  bool streaming_ = false, closing_ = false;
};

}  // namespace lightwell::core
