#include "link/access/certificate.hpp"

#include <array>
#include <ctime>
#include <memory>

#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <lightwell/deleter.hpp>

namespace lightwell {
namespace {

using Bio = std::unique_ptr<BIO, Deleter<BIO_free_all>>;
using BigNumber = std::unique_ptr<BIGNUM, Deleter<BN_free>>;
using Key = std::unique_ptr<EVP_PKEY, Deleter<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Deleter<X509_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, Deleter<X509_EXTENSION_free>>;

Bio reader_of(const std::string& pem) { return Bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()))); }

/// Password callback that fails, so that an encrypted file is an error instead of a prompt.
int no_password(char*, int, int, void*) { return 0; }

Certificate certificate_of(const std::string& pem) {
  const Bio in = reader_of(pem);
  return Certificate(in ? PEM_read_bio_X509(in.get(), nullptr, no_password, nullptr) : nullptr);
}
Key private_key_of(const std::string& pem) {
  const Bio in = reader_of(pem);
  return Key(in ? PEM_read_bio_PrivateKey(in.get(), nullptr, no_password, nullptr) : nullptr);
}

bool is_p256(const EVP_PKEY* key) {
  std::array<char, 32> group{};
  return EVP_PKEY_get_group_name(key, group.data(), group.size(), nullptr) == 1 &&
         OBJ_txt2nid(group.data()) == NID_X9_62_prime256v1;
}

bool add_extension(X509* to, X509* issuer, int nid, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, to, nullptr, nullptr, 0);
  const Extension extension(X509V3_EXT_conf_nid(nullptr, &context, nid, value));
  return extension && X509_add_ext(to, extension.get(), -1) == 1;
}

bool add_uses(X509* to, X509* issuer, CertificateUse use) {
  if (use == CertificateUse::authority)
    return add_extension(to, issuer, NID_basic_constraints, "critical,CA:TRUE,pathlen:0") &&
           add_extension(to, issuer, NID_key_usage, "critical,keyCertSign,cRLSign") &&
           add_extension(to, issuer, NID_subject_key_identifier, "hash");
  return add_extension(to, issuer, NID_basic_constraints, "critical,CA:FALSE") &&
         add_extension(to, issuer, NID_key_usage, "critical,digitalSignature") &&
         add_extension(to, issuer, NID_ext_key_usage, use == CertificateUse::probe ? "serverAuth" : "clientAuth") &&
         add_extension(to, issuer, NID_subject_key_identifier, "hash") &&
         add_extension(to, issuer, NID_authority_key_identifier, "keyid") &&
         (use != CertificateUse::probe ||
          add_extension(to, issuer, NID_subject_alt_name, (std::string("DNS:") + kProbeHostName).c_str()));
}

bool set_name(X509_NAME* name, const std::string& common_name) {
  const std::string shown = common_name.empty() ? "lightwell" : common_name.substr(0, 64);
  return X509_NAME_add_entry_by_txt(name, "O", MBSTRING_ASC, reinterpret_cast<const unsigned char*>("Lightwell"), -1,
                                    -1, 0) == 1 &&
         X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_UTF8, reinterpret_cast<const unsigned char*>(shown.data()),
                                    static_cast<int>(shown.size()), -1, 0) == 1;
}

bool set_random_serial(X509* certificate) {
  // RFC 5280, 4.1.2.2: positive, at most 20 bytes.
  const BigNumber serial(BN_new());
  return serial && BN_rand(serial.get(), 127, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY) == 1 &&
         BN_to_ASN1_INTEGER(serial.get(), X509_get_serialNumber(certificate)) != nullptr;
}

bool set_times(X509* certificate, const CertificateRequest& request) {
  return ASN1_TIME_set(X509_getm_notBefore(certificate), static_cast<std::time_t>(request.not_before_s)) != nullptr &&
         ASN1_TIME_set(X509_getm_notAfter(certificate), static_cast<std::time_t>(request.not_after_s)) != nullptr;
}

std::string text_of(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return size > 0 ? std::string(data, static_cast<std::size_t>(size)) : std::string();
}

}  // namespace

Result<std::string> issue_certificate(const CertificateRequest& request, const CertifiedKey& issuer) {
  const Bio in = reader_of(request.public_key);
  const Key subject_key(in ? PEM_read_bio_PUBKEY(in.get(), nullptr, no_password, nullptr) : nullptr);
  if (!subject_key || !is_p256(subject_key.get()))
    return Status(StatusCode::invalid_argument, "the public key is not a P-256 key in PEM form");
  const Key signer = private_key_of(issuer.key);
  const Certificate parent = issuer.certificate.empty() ? Certificate() : certificate_of(issuer.certificate);
  if (!signer || (!issuer.certificate.empty() && !parent))
    return Status(StatusCode::invalid_argument, "the issuer's certificate or key is not readable PEM");
  const Certificate made(X509_new());
  const Bio out(BIO_new(BIO_s_mem()));
  X509* const issued_by = parent ? parent.get() : made.get();
  if (!made || !out || X509_set_version(made.get(), X509_VERSION_3) != 1 || !set_random_serial(made.get()) ||
      !set_times(made.get(), request) || !set_name(X509_get_subject_name(made.get()), request.common_name) ||
      X509_set_issuer_name(made.get(), X509_get_subject_name(issued_by)) != 1 ||
      X509_set_pubkey(made.get(), subject_key.get()) != 1 || !add_uses(made.get(), issued_by, request.use) ||
      X509_sign(made.get(), signer.get(), EVP_sha256()) == 0 || PEM_write_bio_X509(out.get(), made.get()) != 1)
    return Status(StatusCode::internal, "OpenSSL failed to create a certificate for '" + request.common_name + "'");
  return text_of(out.get());
}

Status check_key_matches_certificate(const std::string& certificate, const std::string& key) {
  const Certificate x509 = certificate_of(certificate);
  const Key private_key = private_key_of(key);
  if (!x509) return invalid_argument("no certificate in PEM form");
  if (!private_key) return invalid_argument("no private key in PEM form, or one with a pass phrase");
  if (X509_check_private_key(x509.get(), private_key.get()) != 1)
    return invalid_argument("the key does not belong to the certificate");
  return {};
}

Result<std::string> public_key_of(const std::string& private_key) {
  const Key key = private_key_of(private_key);
  const Bio out(BIO_new(BIO_s_mem()));
  if (!key || !out || PEM_write_bio_PUBKEY(out.get(), key.get()) != 1)
    return Status(StatusCode::data_loss, "no private key in PEM form");
  return text_of(out.get());
}

}  // namespace lightwell
