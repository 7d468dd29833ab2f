// ProbeService: what a probe answers, and the streams of its clients.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <grpcpp/grpcpp.h>

#include <lightwell/probe_calls.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>

#include "lightwell/v1/probe_service.grpc.pb.h"
#include "link/grpc/descriptor_stream.hpp"
#include "link/link.hpp"

namespace lightwell {

/// Answers by bytes: descriptors go out as the publisher made them, and what comes in is read and parsed here, where
/// what is no message, too large or never whole can be refused and counted. To the wire a call with one request and one
/// answer is a stream like any other, so that every method is registered as one: of the others gRPC reads the request
/// by itself, and tells nobody where that fails.
class ProbeService final : public grpc::Service {
 public:
  /// A request of this size is refused; the largest that means anything has some hundred bytes.
  static constexpr std::size_t kMaxRequestBytes = 4096;

  /// `commands` outlives it and is called from gRPC's threads.
  explicit ProbeService(Commands& commands);

  void publish(const EncodedDescriptor& descriptor);
  [[nodiscard]] StreamClients& streams() { return streams_; }
  /// Clients, what they missed, and what was refused.
  [[nodiscard]] LinkCounters counters() const;

 private:
  class Call;
  /// What a method does with the bytes of its request.
  using Method = void (ProbeService::*)(const std::string& request, ByteCall& call);
  /// `path` lives as long as the service.
  void add(const char* path, Method method);

  void stream_descriptors(const std::string& request, ByteCall& call);
  void get_descriptor(const std::string& request, ByteCall& call);
  void info(const std::string& request, ByteCall& call);
  void set_config(const std::string& request, ByteCall& call);
  void report_lux(const std::string& request, ByteCall& call);
  void get_config(const std::string& request, ByteCall& call);

  /// Bytes that came whole; or counts, and says why not.
  [[nodiscard]] Result<std::string> validate_request(bool came, const grpc::ByteBuffer& bytes);
  /// Reads a request; where it is none, counts it, finishes the call and returns false.
  template <class Request>
  [[nodiscard]] bool read(const std::string& bytes, Request& request, ByteCall& call);
  /// What Commands say, by answer_probe_call().
  void answer(ProbeCall which, const std::string& request, ByteCall& call);
  /// Counts it, and finishes the call.
  void refuse(const std::string& why, ByteCall& call);

  Commands& commands_;
  int methods_ = 0;
  StreamClients streams_;
  std::atomic<std::uint64_t> refused_{0};
  std::mutex newest_mutex_;
  std::optional<grpc::ByteBuffer> newest_;
};

}  // namespace lightwell
