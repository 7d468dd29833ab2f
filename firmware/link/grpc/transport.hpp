// Server credentials and resource limits of the probe's gRPC servers.
#pragma once

#include <memory>
#include <string>

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_builder.h>

#include <lightwell/result.hpp>

#include "link/access/probe_keys.hpp"
#include "link/grpc/call_authorizer.hpp"

namespace lightwell {

/// Whether the TLS handshake requests a client's certificate. A certificate that is sent is verified.
enum class ClientCertificates { not_requested, optional, required };
/// Credentials with fixed keys, for a short-lived server.
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> tls_credentials(const ProbeKeys& keys,
                                                                       ClientCertificates clients);
/// Credentials for a long-running server: each handshake uses the current keys of `keys`; existing connections are
/// kept. `authorizer` decides on each call.
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> reloading_tls_credentials(
    std::shared_ptr<ReloadingKeys> keys, ClientCertificates clients, std::shared_ptr<CallAuthorizer> authorizer);

/// gRPC refuses larger messages without reading them. The services have smaller limits and count what they refuse.
inline constexpr int kMaxWireMessageBytes = 64 * 1024;
/// Disables port sharing and limits the resources of a connection.
void set_limits(grpc::ServerBuilder& builder);

/// The error for an address on which the server cannot listen. `options`: the options that set it.
[[nodiscard]] Status listen_error(const std::string& listen, const std::string& options);

}  // namespace lightwell
