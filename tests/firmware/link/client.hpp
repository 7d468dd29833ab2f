// Clients of the gRPC link that exchange raw bytes instead of messages.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include "firmware/link/link_messages.hpp"
#include "link/link.hpp"
#include "support/wait.hpp"

namespace lightwell::test {

/// A channel with its own connection; by default gRPC shares one between channels to the same address.
[[nodiscard]] std::shared_ptr<grpc::Channel> connect(
    const Link& link,
    const std::shared_ptr<grpc::ChannelCredentials>& credentials = grpc::InsecureChannelCredentials());

/// HOST:PORT of a link's address, for example "127.0.0.1:7420".
[[nodiscard]] std::string host_port(const Link& link);

struct Reply {
  grpc::Status status;
  std::string bytes;
  std::string certificate;  ///< The server's certificate, PEM; empty: plain text, or no handshake.
};

/// A unary call of `method`, for example "/lightwell.v1.ProbeService/Info". Waits at most kTestTimeout.
[[nodiscard]] Reply call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                         const std::string& request, const std::string& authorization = {});

/// A call with a stream of responses. For one thread.
class RawStream {
 public:
  static constexpr const char* kDescriptors = "/lightwell.v1.ProbeService/StreamDescriptors";

  explicit RawStream(std::shared_ptr<grpc::Channel> channel, const std::string& method = kDescriptors,
                     const std::string& request = {});
  RawStream(const RawStream&) = delete;
  RawStream& operator=(const RawStream&) = delete;
  /// Cancels the call.
  ~RawStream();

  /// The next message; nullopt if the stream ended or the time is over.
  [[nodiscard]] std::optional<std::string> next(std::chrono::milliseconds timeout = kTestTimeout);
  /// Reads until the server ends the stream and returns its status; DEADLINE_EXCEEDED after kTestTimeout.
  [[nodiscard]] grpc::Status end();

  /// Cancels the call without a message to the server's application.
  void cancel() { context_.TryCancel(); }

 private:
  [[nodiscard]] bool await(std::chrono::milliseconds timeout, bool& ok);

  grpc::CompletionQueue queue_;
  grpc::ClientContext context_;
  grpc::GenericStub stub_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
  grpc::ByteBuffer buffer_;
  bool reading_ = false, ended_ = false;
};

}  // namespace lightwell::test
