// How a server of the probe listens: what it is encrypted with, and how much a client may ask of it.
#pragma once

#include <memory>
#include <string>

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_builder.h>

#include <lightwell/result.hpp>

#include "link/access/probe_keys.hpp"

namespace lightwell {

/// Of clients' certificates in a handshake.
enum class ClientCertificates { not_asked, welcome, required };
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> tls_credentials(const ProbeKeys& keys,
                                                                       ClientCertificates clients);

/// No message above this is read at all; those who serve have smaller limits, and count.
inline constexpr int kMaxWireMessageBytes = 64 * 1024;
/// Ports that are not shared, and bounds on what one connection may ask.
void set_limits(grpc::ServerBuilder& builder);

/// Why nothing listens at `listen`.
[[nodiscard]] Status cannot_listen(const std::string& listen, const std::string& options);

}  // namespace lightwell
