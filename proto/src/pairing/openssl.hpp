// Owning pointers for OpenSSL's objects, and functions that several files use.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/x509.h>

#include <lightwell/deleter.hpp>

namespace lightwell::pairing {

using Bio = std::unique_ptr<BIO, Deleter<BIO_free_all>>;
using BigNumber = std::unique_ptr<BIGNUM, Deleter<BN_clear_free>>;
using BigNumberContext = std::unique_ptr<BN_CTX, Deleter<BN_CTX_free>>;
using Group = std::unique_ptr<EC_GROUP, Deleter<EC_GROUP_free>>;
using Point = std::unique_ptr<EC_POINT, Deleter<EC_POINT_clear_free>>;
using Key = std::unique_ptr<EVP_PKEY, Deleter<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Deleter<X509_free>>;

/// Password callback that fails, so that an encrypted file is an error instead of a prompt.
inline int no_password(char*, int, int, void*) { return 0; }

[[nodiscard]] inline const unsigned char* bytes_of(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}
[[nodiscard]] inline unsigned char* bytes_of(std::string& text) {
  return reinterpret_cast<unsigned char*>(text.data());
}

/// HKDF (RFC 5869) with SHA-256 and no salt. Empty if OpenSSL fails.
[[nodiscard]] std::string hkdf(std::string_view secret, std::string_view info, std::size_t length);
/// HMAC (RFC 2104) with SHA-256.
[[nodiscard]] std::string hmac(std::string_view key, std::string_view message);

}  // namespace lightwell::pairing
