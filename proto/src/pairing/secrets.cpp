#include <array>
#include <chrono>
#include <ctime>

#include <openssl/core_names.h>
#include <openssl/crypto.h>
#include <openssl/hmac.h>
#include <openssl/kdf.h>
#include <openssl/params.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/sha.h>
#include <openssl/x509v3.h>

#include <lightwell/secrets.hpp>

#include "pairing/openssl.hpp"

namespace lightwell {
namespace pairing {

std::string hkdf(std::string_view secret, std::string_view info, std::size_t length) {
  using Kdf = std::unique_ptr<EVP_KDF, Deleter<EVP_KDF_free>>;
  using KdfContext = std::unique_ptr<EVP_KDF_CTX, Deleter<EVP_KDF_CTX_free>>;
  const Kdf kdf(EVP_KDF_fetch(nullptr, "HKDF", nullptr));
  const KdfContext context(kdf ? EVP_KDF_CTX_new(kdf.get()) : nullptr);
  if (!context) return {};
  // OpenSSL's parameters take non-const pointers to data that it only reads.
  std::string digest = "SHA256", key(secret), label(info), out(length, '\0');
  const std::array<OSSL_PARAM, 4> parameters = {
      OSSL_PARAM_construct_utf8_string(OSSL_KDF_PARAM_DIGEST, digest.data(), 0),
      OSSL_PARAM_construct_octet_string(OSSL_KDF_PARAM_KEY, key.data(), key.size()),
      OSSL_PARAM_construct_octet_string(OSSL_KDF_PARAM_INFO, label.data(), label.size()), OSSL_PARAM_construct_end()};
  const int done = EVP_KDF_derive(context.get(), bytes_of(out), out.size(), parameters.data());
  OPENSSL_cleanse(key.data(), key.size());
  return done == 1 ? out : std::string();
}

std::string hmac(std::string_view key, std::string_view message) {
  std::string out(SHA256_DIGEST_LENGTH, '\0');
  unsigned length = 0;
  if (HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()), bytes_of(message), message.size(), bytes_of(out),
           &length) == nullptr)
    return {};
  return out;
}

namespace {

/// Content of a memory BIO.
std::string text_of(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return size > 0 ? std::string(data, static_cast<std::size_t>(size)) : std::string();
}

Certificate first_certificate(std::string_view pem) {
  const Bio bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
  return Certificate(bio ? PEM_read_bio_X509(bio.get(), nullptr, no_password, nullptr) : nullptr);
}

std::string host_of(X509* certificate) {
  using Names = std::unique_ptr<GENERAL_NAMES, Deleter<GENERAL_NAMES_free>>;
  const Names names(static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr)));
  for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const GENERAL_NAME* const name = sk_GENERAL_NAME_value(names.get(), i);
    if (name->type != GEN_DNS) continue;
    return {reinterpret_cast<const char*>(ASN1_STRING_get0_data(name->d.dNSName)),
            static_cast<std::size_t>(ASN1_STRING_length(name->d.dNSName))};
  }
  if (X509_check_ca(certificate) != 0) return {};
  std::array<char, 256> common_name{};
  X509_NAME_get_text_by_NID(X509_get_subject_name(certificate), NID_commonName, common_name.data(),
                            static_cast<int>(common_name.size()));
  return common_name.data();
}

}  // namespace
}  // namespace pairing

Result<std::string> random_bytes(std::size_t count) {
  std::string out(count, '\0');
  if (RAND_priv_bytes(pairing::bytes_of(out), static_cast<int>(count)) != 1)
    return Status(StatusCode::internal, "the system's random number generator failed");
  return out;
}

Result<std::string> random_code() {
  constexpr std::uint32_t kCodes = 1'000'000;
  constexpr std::uint32_t kRejectionLimit = UINT32_MAX - UINT32_MAX % kCodes;
  for (;;) {
    const Result<std::string> bytes = random_bytes(4);
    if (!bytes) return bytes.status();
    std::uint32_t value = 0;
    for (const char c : *bytes) value = value << 8 | static_cast<unsigned char>(c);
    // Rejection sampling: values above the largest multiple of a million would make some codes more likely.
    if (value >= kRejectionLimit) continue;
    std::string code = std::to_string(value % kCodes);
    code.insert(0, 6 - code.size(), '0');
    return code;
  }
}

std::string sha256(std::string_view bytes) {
  std::string out(SHA256_DIGEST_LENGTH, '\0');
  SHA256(pairing::bytes_of(bytes), bytes.size(), pairing::bytes_of(out));
  return out;
}

std::string to_hex(std::string_view bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string out;
  out.reserve(2 * bytes.size());
  for (const char c : bytes) {
    const auto value = static_cast<unsigned char>(c);
    out += kDigits[value >> 4];
    out += kDigits[value & 15];
  }
  return out;
}

std::string to_base64url(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::string out;
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : bytes) {
    bits = bits << 8 | static_cast<unsigned char>(c);
    for (held += 8; held >= 6; held -= 6) out += kDigits[bits >> (held - 6) & 63];
  }
  if (held > 0) out += kDigits[bits << (6 - held) & 63];
  return out;
}

bool same_secret(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

Result<KeyPair> KeyPair::make() {
  const pairing::Key key(EVP_EC_gen("P-256"));
  const pairing::Bio secret(BIO_new(BIO_s_secmem())), open(BIO_new(BIO_s_mem()));
  if (!key || !secret || !open ||
      PEM_write_bio_PKCS8PrivateKey(secret.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) != 1 ||
      PEM_write_bio_PUBKEY(open.get(), key.get()) != 1)
    return Status(StatusCode::internal, "OpenSSL could not generate a P-256 key");
  return KeyPair{pairing::text_of(secret.get()), pairing::text_of(open.get())};
}

Result<std::string> certificate_digest(std::string_view pem) {
  const pairing::Certificate certificate = pairing::first_certificate(pem);
  std::string out(SHA256_DIGEST_LENGTH, '\0');
  unsigned length = 0;
  if (!certificate || X509_digest(certificate.get(), EVP_sha256(), pairing::bytes_of(out), &length) != 1)
    return Status(StatusCode::data_loss, "no certificate in PEM form");
  return out;
}

namespace {

/// Seconds since 1970 in UTC; 0 for a time that is not valid.
std::int64_t unix_seconds(const ASN1_TIME* time) {
  std::tm t{};
  if (ASN1_TIME_to_tm(time, &t) != 1) return 0;
  const std::chrono::year_month_day date(std::chrono::year(t.tm_year + 1900),
                                         std::chrono::month(static_cast<unsigned>(t.tm_mon + 1)),
                                         std::chrono::day(static_cast<unsigned>(t.tm_mday)));
  const auto day = std::chrono::sys_days(date).time_since_epoch();
  return std::chrono::seconds(day).count() + (t.tm_hour * 60 + t.tm_min) * 60 + t.tm_sec;
}

}  // namespace

Result<CertificateIdentity> identify_certificate(std::string_view pem) {
  const pairing::Certificate held = pairing::first_certificate(pem);
  const pairing::Bio text(BIO_new(BIO_s_mem()));
  unsigned char* der = nullptr;
  const int length = held ? i2d_X509_PUBKEY(X509_get_X509_PUBKEY(held.get()), &der) : -1;
  if (length <= 0 || !text || PEM_write_bio_X509(text.get(), held.get()) != 1) {
    OPENSSL_free(der);
    return Status(StatusCode::data_loss, "no certificate in PEM form");
  }
  CertificateIdentity out;
  out.pem = pairing::text_of(text.get());
  out.key_digest = sha256({reinterpret_cast<const char*>(der), static_cast<std::size_t>(length)});
  OPENSSL_free(der);
  out.is_authority = X509_check_ca(held.get()) != 0;
  out.is_server = X509_check_purpose(held.get(), X509_PURPOSE_SSL_SERVER, 0) == 1;
  // X509_cmp_current_time() returns 0 for an invalid time.
  out.is_in_date = X509_cmp_current_time(X509_get0_notBefore(held.get())) < 0 &&
                   X509_cmp_current_time(X509_get0_notAfter(held.get())) > 0;
  out.expires_s = unix_seconds(X509_get0_notAfter(held.get()));
  out.host = pairing::host_of(held.get());
  return out;
}

}  // namespace lightwell
