// Channel credentials of gRPC.
#pragma once

#include <memory>

#include <grpcpp/security/credentials.h>

#include <lightwell/credentials.hpp>

namespace lightwell::core {

[[nodiscard]] std::shared_ptr<grpc::ChannelCredentials> plain_credentials();

/// The handshake fails if the probe's certificate is expired, not for a server, for another host (with `ca`), or has
/// another key than the pinned one. If `pinned` is an authority, it must have issued the certificate, which must be
/// valid for kProbeHostName. The token is sent with each call, after the handshake.
[[nodiscard]] std::shared_ptr<grpc::ChannelCredentials> tls_credentials(const ProbeCredentials& credentials);

/// TLS without verification of the server. For pairing, which authenticates the server by the code.
[[nodiscard]] std::shared_ptr<grpc::ChannelCredentials> unverified_credentials();

}  // namespace lightwell::core
