// X.509 certificates on P-256 that a probe issues for itself and for its clients. All keys and certificates are PEM.
#pragma once

#include <cstdint>
#include <string>

#include <lightwell/result.hpp>
#include <lightwell/secrets.hpp>

namespace lightwell {

/// Purpose of a certificate, stored in its key usage extensions, so that a client's certificate cannot authenticate a
/// probe.
enum class CertificateUse { authority, probe, client };

/// 2020-01-01. Certificates must be valid, too, for a board whose clock is years behind (no battery).
inline constexpr std::int64_t kDefaultNotBefore_s = 1'577'836'800;

struct CertificateRequest {
  CertificateUse use = CertificateUse::probe;
  std::string common_name;  ///< For people; truncated to 64 bytes.
  std::string public_key;   ///< SubjectPublicKeyInfo.
  std::int64_t not_before_s = kDefaultNotBefore_s;
  std::int64_t not_after_s = 0;  ///< Seconds since 1970.
};

struct CertifiedKey {
  std::string certificate, key;
};

/// An issuer with an empty certificate means self-signed with its key. invalid_argument: the key is not on P-256, or
/// the issuer's certificate or key cannot be read.
[[nodiscard]] Result<std::string> issue_certificate(const CertificateRequest& request, const CertifiedKey& issuer);

/// invalid_argument: `key` cannot be read or does not belong to `certificate`.
[[nodiscard]] Status check_key_matches_certificate(const std::string& certificate, const std::string& key);

/// The public key of a private key. data_loss: it cannot be read.
[[nodiscard]] Result<std::string> public_key_of(const std::string& private_key);

}  // namespace lightwell
