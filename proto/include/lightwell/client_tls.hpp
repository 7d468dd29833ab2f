// TLS of a client that uses OpenSSL itself (not gRPC): the check of a probe's certificate. Needs the library
// lightwell_pairing.
#pragma once

#include <memory>
#include <string>

#include <lightwell/result.hpp>

// OpenSSL's SSL_CTX and X509_STORE_CTX.
struct ssl_ctx_st;
struct x509_store_ctx_st;

namespace lightwell {

/// What a client trusts and shows. PEM; either `pinned` or `ca`. Meanings: ProbeCredentials of the SDK.
struct ClientTlsOptions {
  std::string pinned, ca;
  std::string host;  ///< Name or IP address that the certificate must have, with `ca`.
  std::string certificate, key;
};

/// A context for connections over TLS 1.2 or 1.3, in which the handshake fails unless the server's certificate is in
/// date, is one for a server, and is of the pinned key; or the pinned authority signed it, and it names kProbeHostName;
/// or `ca` signed it, and it names `host`. One thread.
class ClientTls {
 public:
  /// invalid_argument: OpenSSL cannot read the certificates or the key, or they do not belong together.
  [[nodiscard]] static Result<std::unique_ptr<ClientTls>> make(const ClientTlsOptions& options);
  ~ClientTls();

  /// Valid as long as this object.
  [[nodiscard]] ssl_ctx_st* context() const;
  /// Why the last server's certificate was rejected; empty if it was accepted.
  [[nodiscard]] const std::string& rejection() const { return rejection_; }
  /// Before a handshake.
  void forget_rejection() { rejection_.clear(); }

 private:
  struct Parts;
  explicit ClientTls(std::unique_ptr<Parts> parts);
  [[nodiscard]] std::string fault_of(x509_store_ctx_st* handshake) const;

  const std::unique_ptr<Parts> parts_;
  std::string rejection_;
};

}  // namespace lightwell
