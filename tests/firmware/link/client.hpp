// Clients of the gRPC link that see bytes, not messages.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include "link/link.hpp"
#include "support/wait.hpp"

namespace lightwell::test {

/// A connection of its own: gRPC would let channels to one address share one.
[[nodiscard]] std::shared_ptr<grpc::Channel> connect(
    const Link& link,
    const std::shared_ptr<grpc::ChannelCredentials>& credentials = grpc::InsecureChannelCredentials());

/// "127.0.0.1:7420" of a link's address.
[[nodiscard]] std::string host_port(const Link& link);

struct Reply {
  grpc::Status status;
  std::string bytes;
  std::string certificate;  ///< PEM, as the server showed it; empty: plain text, or no handshake.
};

/// A unary call, "/lightwell.v1.ProbeService/Info". Waits at most kTestTimeout.
[[nodiscard]] Reply call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                         const std::string& request, const std::string& authorization = {});

/// A call whose answer is a stream. One thread.
class RawStream {
 public:
  static constexpr const char* kDescriptors = "/lightwell.v1.ProbeService/StreamDescriptors";

  explicit RawStream(std::shared_ptr<grpc::Channel> channel, const std::string& method = kDescriptors,
                     const std::string& request = {});
  RawStream(const RawStream&) = delete;
  RawStream& operator=(const RawStream&) = delete;
  /// Cancels.
  ~RawStream();

  /// The next message; nothing where the stream ended or none came in time.
  [[nodiscard]] std::optional<std::string> next(std::chrono::milliseconds timeout = kTestTimeout);
  /// How the server ended it. Waits at most kTestTimeout, reading on; DEADLINE_EXCEEDED after that.
  [[nodiscard]] grpc::Status end();

  /// Goes without a word to the server's application.
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

/// A descriptor's bytes, as far as a link is concerned: the number, and the length asked for.
[[nodiscard]] EncodedDescriptor message(int number, std::size_t bytes = 16);
[[nodiscard]] std::string text_of(const EncodedDescriptor& descriptor);

}  // namespace lightwell::test
