// Helpers for gRPC: channels, their credentials, deadlines, status codes, message bytes.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <grpc/support/time.h>
#include <grpcpp/channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/status.h>

#include <lightwell/credentials.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell::core {

/// A deadline in the monotonic clock, which changes of the wall clock do not affect.
[[nodiscard]] gpr_timespec deadline_after(Duration from_now);

/// The handshake fails if the probe's certificate is expired, not for a server, for another host (with `ca`), or has
/// another key than the pinned one. If `pinned` is an authority, it must have issued the certificate, which must be
/// valid for kProbeHostName. The token is sent with each call, after the handshake.
[[nodiscard]] std::shared_ptr<grpc::ChannelCredentials> tls_credentials(const ProbeCredentials& credentials);

/// TLS without verification of the server. For pairing, which authenticates the server by the code.
[[nodiscard]] std::shared_ptr<grpc::ChannelCredentials> unverified_credentials();

/// A channel with a new TCP connection, never a dead one shared with an earlier channel. A name in .local is resolved
/// by multicast DNS, which takes at most a second and ends early once `*stopping` is set; without an answer, DNS is
/// used as for any name. Certificates are verified against the name.
[[nodiscard]] std::shared_ptr<grpc::Channel> new_channel(const std::string& host_port,
                                                         const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                                                         const std::atomic<bool>* stopping = nullptr);

/// The nearest StatusCode, with gRPC's message.
[[nodiscard]] Status status_of(const grpc::Status& status);

/// The bytes of a message, contiguous in `storage`, whose memory is reused.
[[nodiscard]] std::span<const std::byte> bytes_of(const grpc::ByteBuffer& buffer, std::vector<std::byte>& storage);

}  // namespace lightwell::core
