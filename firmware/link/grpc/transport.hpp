// What the probe's gRPC servers share: credentials, resource limits, errors.
#pragma once

#include <memory>

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_builder.h>
#include <grpcpp/support/status.h>

#include <lightwell/result.hpp>

#include "link/access/call_authorizer.hpp"
#include "link/access/probe_keys.hpp"

namespace lightwell {

/// Credentials with fixed keys, for a short-lived server that requests no certificate of a client.
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> tls_credentials(const ProbeKeys& keys);
/// Credentials for a long-running server: each handshake uses the current keys of `keys`; existing connections are
/// kept. `authorizer` decides on each call.
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> reloading_tls_credentials(
    std::shared_ptr<ReloadingKeys> keys, ClientCertificates clients, std::shared_ptr<CallAuthorizer> authorizer);

/// Disables port sharing and limits the resources of a connection.
void set_limits(grpc::ServerBuilder& builder);

[[nodiscard]] grpc::Status rpc_status(const Status& s);

}  // namespace lightwell
