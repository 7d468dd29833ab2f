// Lets a call in, or not: before its message is read and before any handler runs.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string_view>

#include "link/access/client_list.hpp"

namespace lightwell {

/// Whom a certificate that the handshake accepted lets in.
enum class CertificatePolicy {
  any,     ///< All: the owner's authority has judged.
  listed,  ///< Those of the client list.
};

/// What is known of a call before its message is read. What it lacks is empty.
struct CallCredentials {
  std::string_view path;           ///< "/lightwell.v1.ProbeService/Info".
  std::string_view authorization;  ///< "Bearer TOKEN".
  std::string_view certificate;    ///< PEM; one that the handshake accepted. A client need not show one.
};

/// A call needs a certificate that the handshake accepted, or a token of the client list; health needs neither. No
/// token, a wrong one and an expired one get the same text after the same work. Takes microseconds. Any thread.
class CallAuthorizer {
 public:
  CallAuthorizer(std::shared_ptr<ClientList> clients, CertificatePolicy rule) : clients_(std::move(clients)), rule_(rule) {}

  /// What to do, for whom is refused; nullptr: let in.
  [[nodiscard]] const char* denial_reason(const CallCredentials& call);

  [[nodiscard]] std::uint64_t refused() const { return refused_.load(std::memory_order_relaxed); }

 private:
  [[nodiscard]] bool accepts_certificate(std::string_view pem, std::int64_t now_s) const;

  const std::shared_ptr<ClientList> clients_;
  const CertificatePolicy rule_;
  std::atomic<std::uint64_t> refused_{0};
};

}  // namespace lightwell
