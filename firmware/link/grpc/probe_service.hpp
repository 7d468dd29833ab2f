// ProbeService on gRPC: requests of clients, and descriptor streams with one write in progress and one slot for the
// newest descriptor each.
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/server_builder.h>

#include <lightwell/commands.hpp>
#include <lightwell/probe_calls.hpp>
#include <lightwell/result.hpp>

#include "lightwell/v1/probe_service.grpc.pb.h"
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
  /// Ends every stream and waits for them, at most 200 ms.
  void close_streams();
  /// Number of clients, coalesced descriptors and refused messages.
  [[nodiscard]] LinkCounters counters() const;

 private:
  class Call;
  class Dispatcher;
  /// Handler of a method; receives the bytes of its request.
  using Method = void (ProbeService::*)(const std::string& request, Call& call);

  void stream_descriptors(const std::string& request, Call& call);
  void get_descriptor(const std::string& request, Call& call);
  /// Responds with the result of answer_probe_call().
  template <ProbeCall which>
  void answer(const std::string& request, Call& call);

  /// The bytes of a complete request of allowed size; otherwise counts it and returns the reason. `received`:
  /// OnReadDone's.
  [[nodiscard]] Result<std::string> validate_request(bool received, const grpc::ByteBuffer& bytes);
  /// Parses a request; a malformed one is counted, the call finished, and false returned.
  template <class Request>
  [[nodiscard]] bool read(const std::string& bytes, Request& request, Call& call);
  /// Counts the request and finishes the call with INVALID_ARGUMENT.
  void refuse(const std::string& why, Call& call);

  /// Turns a call into a stream: it receives every descriptor, or the newest ones if it is slow.
  void add_stream(Call& call);
  /// Does nothing for a call that is no stream.
  void remove_stream(Call& call);

  Commands& commands_;
  std::unique_ptr<grpc::CallbackGenericService> dispatcher_;
  /// Serves no call: reflection lists services with registered methods, which the generic service does not have.
  v1::ProbeService::CallbackService listed_;
  std::atomic<std::uint64_t> refused_{0}, coalesced_{0};
  std::mutex newest_mutex_;
  std::optional<grpc::ByteBuffer> newest_;

  mutable std::mutex streams_mutex_;
  std::condition_variable stream_removed_;
  std::vector<Call*> streams_;
  bool closing_ = false;
};

}  // namespace lightwell
