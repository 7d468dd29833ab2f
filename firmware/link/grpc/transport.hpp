// What the probe's gRPC servers share: credentials, the authorization of calls, resource limits, errors.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_builder.h>
#include <grpcpp/support/status.h>

#include <lightwell/result.hpp>

#include "link/access/client_list.hpp"
#include "link/access/probe_keys.hpp"

namespace lightwell {

/// Which of the certificates that the TLS handshake has verified authorize a call.
enum class CertificatePolicy {
  any,     ///< All, because the owner's authority issued them.
  listed,  ///< Those of the client list.
};

/// The properties of a call that are known before its message is read; missing ones are empty.
struct CallCredentials {
  std::string_view path;           ///< "/lightwell.v1.ProbeService/Info".
  std::string_view authorization;  ///< "Bearer TOKEN".
  std::string_view certificate;    ///< PEM, verified by the handshake; optional.
};

/// Authorizes calls before their messages are read and before any handler runs. A call needs a verified certificate, as
/// CertificatePolicy says, or a token of the client list; the health service needs neither. A missing, a wrong and an
/// expired token get the same text after the same time. Takes microseconds. Any thread.
class CallAuthorizer {
 public:
  CallAuthorizer(std::shared_ptr<ClientList> clients, CertificatePolicy policy)
      : clients_(std::move(clients)), policy_(policy) {}

  /// nullptr: the call is authorized; otherwise the message for the client, which says what to do.
  [[nodiscard]] const char* denial_reason(const CallCredentials& call);

  [[nodiscard]] std::uint64_t refused() const { return refused_.load(std::memory_order_relaxed); }

 private:
  [[nodiscard]] bool accepts_certificate(std::string_view pem, std::int64_t now_s) const;

  const std::shared_ptr<ClientList> clients_;
  const CertificatePolicy policy_;
  std::atomic<std::uint64_t> refused_{0};
};

/// Credentials with fixed keys, for a short-lived server that requests no certificate of a client.
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> tls_credentials(const ProbeKeys& keys);
/// Whether a client must send a certificate in the TLS handshake. One that is sent is verified.
enum class ClientCertificates { optional, required };
/// Credentials for a long-running server: each handshake uses the current keys of `keys`; existing connections are
/// kept. `authorizer` decides on each call.
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> reloading_tls_credentials(
    std::shared_ptr<ReloadingKeys> keys, ClientCertificates clients, std::shared_ptr<CallAuthorizer> authorizer);

/// Disables port sharing and limits the resources of a connection.
void set_limits(grpc::ServerBuilder& builder);

/// Whether `listen` is HOST:PORT with a port of 0 to 65535. gRPC itself uses port 443 if none is given, and 34463 for
/// 99999.
[[nodiscard]] bool is_host_and_port(std::string_view listen);
[[nodiscard]] grpc::Status rpc_status(const Status& s);
/// The error for an address on which the server cannot listen. `options`: the options that set it.
[[nodiscard]] Status listen_error(const std::string& listen, const std::string& options);

}  // namespace lightwell
