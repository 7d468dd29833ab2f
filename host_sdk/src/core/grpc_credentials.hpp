// Credentials in gRPC's form.
#pragma once

#include <memory>

#include <grpcpp/security/credentials.h>

#include <lightwell/credentials.hpp>

namespace lightwell::core {

[[nodiscard]] std::shared_ptr<grpc::ChannelCredentials> plain_credentials();

/// The handshake fails where the probe's certificate is not good: expired, not made for a server, of another host (with
/// `ca`), or of another key than the one pinned. Where `pinned` is an authority, it must vouch for the certificate,
/// which must name kProbeHostName. A token goes with each call, behind the handshake.
[[nodiscard]] std::shared_ptr<grpc::ChannelCredentials> tls_credentials(const ProbeCredentials& credentials);

/// Encrypts towards whoever answers. For pairing, which finds out by the code who that is.
[[nodiscard]] std::shared_ptr<grpc::ChannelCredentials> unverified_credentials();

}  // namespace lightwell::core
