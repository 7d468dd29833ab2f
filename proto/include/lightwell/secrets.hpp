// Random numbers, digests and keys, for both ends of a link. Needs the library lightwell_pairing.
//   random_bytes, random_code                 from the system's generator
//   sha256, to_hex, to_base64url, same_secret
//   KeyPair, certificate_digest, identify_certificate   P-256 and X.509 in PEM
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <lightwell/result.hpp>

namespace lightwell {

/// internal where the system has no randomness to give.
[[nodiscard]] Result<std::string> random_bytes(std::size_t count);
/// Six digits, each value equally likely.
[[nodiscard]] Result<std::string> random_code();

/// 32 bytes.
[[nodiscard]] std::string sha256(std::string_view bytes);
/// Lower case.
[[nodiscard]] std::string to_hex(std::string_view bytes);
/// RFC 4648 section 5, without padding.
[[nodiscard]] std::string to_base64url(std::string_view bytes);

/// Compares in a time that depends on the lengths alone.
[[nodiscard]] bool same_secret(std::string_view a, std::string_view b);

/// A new P-256 key.
struct KeyPair {
  std::string private_pem;  ///< PKCS #8, not encrypted.
  std::string public_pem;   ///< SubjectPublicKeyInfo.

  [[nodiscard]] static Result<KeyPair> make();
};

/// SHA-256 of the DER form of the first certificate in `pem`, 32 bytes. data_loss where there is none.
[[nodiscard]] Result<std::string> certificate_digest(std::string_view pem);

/// A DNS name in every certificate that a probe's own authority issues for it. A client that trusts this authority
/// checks for this name, whatever the address.
inline constexpr const char* kProbeHostName = "probe.lightwell.internal";

/// What a client that knows a probe compares of a certificate.
struct CertificateIdentity {
  std::string pem;            ///< This certificate alone.
  std::string key_digest;     ///< SHA-256 of its SubjectPublicKeyInfo (RFC 7469, 2.4), 32 bytes: stays where a
                              ///< certificate is renewed under the same key.
  bool is_authority = false;  ///< It may issue certificates (basicConstraints).
  bool is_server = false;     ///< It may be shown by a TLS server (keyUsage, extKeyUsage).
  bool is_in_date = false;    ///< By this machine's clock, when it was read.
  std::string host;           ///< Its first DNS name; where it has none and is no authority, its common name.
};

/// Of the first certificate in `pem`; in a chain that is the server's own. data_loss where there is none.
[[nodiscard]] Result<CertificateIdentity> identify_certificate(std::string_view pem);

}  // namespace lightwell
