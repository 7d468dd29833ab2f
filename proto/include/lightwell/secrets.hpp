// Random numbers, digests and keys, for both ends of a link. Needs the library lightwell_pairing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <lightwell/result.hpp>

namespace lightwell {

/// internal if the system's random number generator fails.
[[nodiscard]] Result<std::string> random_bytes(std::size_t count);
/// Six digits, each value equally likely.
[[nodiscard]] Result<std::string> random_code();

/// 32 bytes.
[[nodiscard]] std::string sha256(std::string_view bytes);
/// Lower case.
[[nodiscard]] std::string to_hex(std::string_view bytes);
/// RFC 4648 section 5, without padding.
[[nodiscard]] std::string to_base64url(std::string_view bytes);

/// Constant-time comparison: the duration depends on the lengths only.
[[nodiscard]] bool same_secret(std::string_view a, std::string_view b);

/// A new P-256 key.
struct KeyPair {
  std::string private_pem;  ///< PKCS #8, not encrypted.
  std::string public_pem;   ///< SubjectPublicKeyInfo.

  [[nodiscard]] static Result<KeyPair> make();
};

/// SHA-256 of the DER form of the first certificate in `pem`, 32 bytes. data_loss if there is none.
[[nodiscard]] Result<std::string> certificate_digest(std::string_view pem);

/// A DNS name in every certificate that a probe's own authority issues for it. A client that trusts this authority
/// checks for this name instead of the probe's address.
inline constexpr const char* kProbeHostName = "probe.lightwell.internal";

/// The properties of a certificate that a client checks.
struct CertificateIdentity {
  std::string pem;             ///< This certificate, without the rest of the chain.
  std::string key_digest;      ///< SHA-256 of its SubjectPublicKeyInfo (RFC 7469, 2.4), 32 bytes: unchanged if the
                               ///< certificate is renewed with the same key.
  bool is_authority = false;   ///< It may issue certificates (basicConstraints).
  bool is_server = false;      ///< A TLS server may use it (keyUsage, extKeyUsage).
  bool is_in_date = false;     ///< Valid by this machine's clock when it was read.
  std::int64_t expires_s = 0;  ///< Seconds since 1970; 0 if it cannot be read.
  std::string host;            ///< Its first DNS name; if it has none and is not an authority, its common name.
};

/// The identity of the first certificate in `pem`, which in a chain is the server's. data_loss if there is none.
[[nodiscard]] Result<CertificateIdentity> identify_certificate(std::string_view pem);

}  // namespace lightwell
