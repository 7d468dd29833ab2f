// X.509 certificates on P-256, as a probe makes them for itself and for its clients. All of it is PEM.
#pragma once

#include <cstdint>
#include <string>

#include <lightwell/result.hpp>
#include <lightwell/secrets.hpp>

namespace lightwell {

/// What a certificate may be used for; written into it, so that a client's cannot stand in for the probe.
enum class CertificateUse { authority, probe, client };

/// 2020-01-01. A board without a battery may wake with a clock of years ago and must be let in nevertheless.
inline constexpr std::int64_t kDefaultNotBefore_s = 1'577'836'800;

struct CertificateRequest {
  CertificateUse use = CertificateUse::probe;
  std::string common_name;  ///< For people; at most 64 bytes of it are used.
  std::string public_key;   ///< SubjectPublicKeyInfo.
  std::int64_t not_before_s = kDefaultNotBefore_s;
  std::int64_t not_after_s = 0;  ///< Seconds since 1970.
};

/// Who signs. Without a certificate: the key signs for itself.
struct Issuer {
  std::string certificate, key;
};

/// invalid_argument where the key is not on P-256 or the issuer's parts cannot be read.
[[nodiscard]] Result<std::string> issue_certificate(const CertificateRequest& order, const Issuer& issuer);

struct CertificateInfo {
  std::int64_t not_after_s = 0;
  std::string common_name;
};

/// Of the first certificate in `pem`. data_loss where there is none.
[[nodiscard]] Result<CertificateInfo> read_certificate(const std::string& pem);

/// invalid_argument where `key` cannot be read or is not the one that `certificate` speaks of.
[[nodiscard]] Status check_key_matches_certificate(const std::string& certificate, const std::string& key);

/// The public half of a private key. data_loss where it cannot be read.
[[nodiscard]] Result<std::string> public_key_of(const std::string& private_key);

}  // namespace lightwell
