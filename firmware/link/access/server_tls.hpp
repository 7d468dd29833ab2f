// TLS of a server that uses OpenSSL itself (not gRPC): the probe's current keys, and checked certificates of clients.
#pragma once

#include <memory>
#include <string>

#include <lightwell/result.hpp>

#include "link/access/call_authorizer.hpp"
#include "link/access/probe_keys.hpp"

// OpenSSL's SSL_CTX and SSL.
struct ssl_ctx_st;
struct ssl_st;

namespace lightwell {

/// TLS 1.2 and 1.3 without sessions that can be resumed, so that each connection is checked. Each handshake uses the
/// current keys; a set of keys that cannot be used is ignored, and the former stays. One thread.
class ServerTls {
 public:
  /// Errors: those of ReloadingKeys::load(); data_loss: OpenSSL cannot use the keys.
  [[nodiscard]] static Result<std::unique_ptr<ServerTls>> make(std::shared_ptr<ReloadingKeys> keys,
                                                               ClientCertificates clients);
  ~ServerTls();

  /// Sets up a context of a server, which must not outlive this object. False if OpenSSL fails.
  [[nodiscard]] bool configure(ssl_ctx_st* context);

  /// The certificate, PEM, that the client sent in the handshake, which checked it; empty if it sent none.
  [[nodiscard]] static std::string client_certificate(const ssl_st* connection);

 private:
  struct Keys;
  ServerTls(std::shared_ptr<ReloadingKeys> source, ClientCertificates clients);
  /// Called in each handshake; 1 on success, as OpenSSL's SSL_CTX_set_cert_cb() defines.
  [[nodiscard]] int use_current_keys(ssl_st* connection);

  const std::shared_ptr<ReloadingKeys> source_;
  const ClientCertificates clients_;
  std::unique_ptr<Keys> keys_;
};

}  // namespace lightwell
