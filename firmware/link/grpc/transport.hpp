// How a server of the probe listens: what it is encrypted with, and how much a client may ask of it.
#pragma once

#include <memory>
#include <string>

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_builder.h>

#include <lightwell/result.hpp>

#include "link/access/probe_keys.hpp"
#include "link/grpc/call_authorizer.hpp"

namespace lightwell {

/// Of clients' certificates in a handshake.
enum class ClientCertificates { not_asked, welcome, required };
/// For a server whose life is short.
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> tls_credentials(const ProbeKeys& keys,
                                                                       ClientCertificates clients);
/// For one that outlives its certificate: each handshake shows what `keys` has at that moment, and connections that are
/// there go on. `gatekeeper` is asked for each call.
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> renewed_tls_credentials(std::shared_ptr<ReloadingKeys> keys,
                                                                               ClientCertificates clients,
                                                                               std::shared_ptr<CallAuthorizer> authorizer);

/// No message above this is read at all; those who serve have smaller limits, and count.
inline constexpr int kMaxWireMessageBytes = 64 * 1024;
/// Ports that are not shared, and bounds on what one connection may ask.
void set_limits(grpc::ServerBuilder& builder);

/// Why nothing listens at `listen`.
[[nodiscard]] Status listen_error(const std::string& listen, const std::string& options);

}  // namespace lightwell
