// Decides which clients may call, by token or certificate.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>

#include "link/access/client_list.hpp"

namespace lightwell {

/// Which of the certificates that the TLS handshake has verified authorize a call.
enum class CertificatePolicy {
  any,     ///< All, because the owner's authority issued them.
  listed,  ///< Those of the client list.
};

/// The credentials of a call or of an HTTP request; missing ones are empty.
struct CallCredentials {
  std::string_view authorization;  ///< "Bearer TOKEN".
  std::string_view certificate;    ///< PEM, verified by the handshake; optional.
};

/// Authorizes calls before their messages are read and before any handler runs. A call needs a verified certificate, as
/// CertificatePolicy says, or a token of the client list. A missing, a wrong and an expired token get the same text
/// after the same time. Takes microseconds. Any thread.
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

/// Whether a client must send a certificate in the TLS handshake. One that is sent is verified.
enum class ClientCertificates { optional, required };

}  // namespace lightwell
