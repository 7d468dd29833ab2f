// One connection to a probe, from its first word to its end.
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
#include "core/grpc_wire.hpp"
#include "core/descriptor_receiver.hpp"

namespace lightwell::core {

/// Asks Info until the clock is known, then follows the stream of descriptors while asking Info
/// once a second. Everything happens on the reader thread, which hands over the completion queue's
/// events. The stream is a generic call: it gives the message's bytes, which a generated stub would
/// have parsed and lost. Destroy it only when drained().
class GrpcConnection {
 public:
  GrpcConnection(std::shared_ptr<grpc::Channel> channel, const ProbeOptions& options, grpc::CompletionQueue& queue,
                 DescriptorReceiver& receiver);

  /// An event of the queue whose tag is this object's (see tags below).
  void on_event(void* tag, bool ok);
  /// What is due by the clock; call it after every event and at next_due().
  void on_time(HostTime now);
  [[nodiscard]] HostTime next_due() const;

  /// Begins the end: cancels what is under way.
  void close(const std::string& error);
  /// After close(), or after the connection broke: no event will come any more.
  [[nodiscard]] bool drained() const { return closing_ && !info_pending_ && !stream_pending_; }
  /// Did it ever get as far as the stream?
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
