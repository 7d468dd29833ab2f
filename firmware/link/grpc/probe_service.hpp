// ProbeService on gRPC: requests of clients and descriptor streams.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/server_builder.h>

#include <lightwell/commands.hpp>
#include <lightwell/probe_calls.hpp>
#include <lightwell/result.hpp>

#include "lightwell/v1/probe_service.grpc.pb.h"
#include "link/grpc/descriptor_stream.hpp"
#include "link/link.hpp"

namespace lightwell {

/// Sends descriptors as the publisher encoded them, and parses requests itself, in order to refuse and count malformed,
/// too large and incomplete ones. A generic service therefore receives all calls as streams of bytes in both
/// directions, which have the same wire format. With the generated service, also with its raw methods, gRPC reads a
/// single request itself and does not report failures.
class ProbeService final {
 public:
  /// Larger requests are refused; the largest valid request has a few hundred bytes.
  static constexpr std::size_t kMaxRequestBytes = 4096;

  /// `commands` must outlive the service and is called from gRPC's threads.
  explicit ProbeService(Commands& commands) : commands_(commands) {}
  /// Registers all methods. Call it once for each server, and destroy that server before this object and before the
  /// next call.
  void register_at(grpc::ServerBuilder& builder);

  void publish(const EncodedDescriptor& descriptor);
  [[nodiscard]] StreamClients& streams() { return streams_; }
  /// Number of clients, coalesced descriptors and refused messages.
  [[nodiscard]] LinkCounters counters() const;

 private:
  class Call;
  class Dispatcher;
  /// Handler of a method; receives the bytes of its request.
  using Method = void (ProbeService::*)(const std::string& request, ByteCall& call);

  void stream_descriptors(const std::string& request, ByteCall& call);
  void get_descriptor(const std::string& request, ByteCall& call);
  void info(const std::string& request, ByteCall& call);
  void set_config(const std::string& request, ByteCall& call);
  void report_lux(const std::string& request, ByteCall& call);
  void get_config(const std::string& request, ByteCall& call);

  /// The bytes of a complete request of allowed size; otherwise counts it and returns the reason. `received`:
  /// OnReadDone's.
  [[nodiscard]] Result<std::string> validate_request(bool received, const grpc::ByteBuffer& bytes);
  /// Parses a request; a malformed one is counted, the call finished, and false returned.
  template <class Request>
  [[nodiscard]] bool read(const std::string& bytes, Request& request, ByteCall& call);
  /// Responds with the result of answer_probe_call().
  void respond(ProbeCall which, const std::string& request, ByteCall& call);
  /// Counts the request and finishes the call with INVALID_ARGUMENT.
  void refuse(const std::string& why, ByteCall& call);

  Commands& commands_;
  std::unique_ptr<grpc::CallbackGenericService> dispatcher_;
  /// Serves no call: reflection lists services with registered methods, which the generic service does not have.
  v1::ProbeService::CallbackService listed_;
  StreamClients streams_;
  std::atomic<std::uint64_t> refused_{0};
  std::mutex newest_mutex_;
  std::optional<grpc::ByteBuffer> newest_;
};

}  // namespace lightwell
