#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>
#include <openssl/x509v3.h>

#include <lightwell/client_tls.hpp>
#include <lightwell/secrets.hpp>

#include "pairing/openssl.hpp"

namespace lightwell {
namespace {

using Context = std::unique_ptr<SSL_CTX, Deleter<SSL_CTX_free>>;
using pairing::Bio;
using pairing::Certificate;
using pairing::no_password;

std::string pem_of(X509* certificate) {
  const Bio text(BIO_new(BIO_s_mem()));
  if (certificate == nullptr || !text || PEM_write_bio_X509(text.get(), certificate) != 1) return {};
  char* begin = nullptr;
  const long length = BIO_get_mem_data(text.get(), &begin);
  return {begin, static_cast<std::size_t>(length)};
}

/// Adds all certificates of `pem` to the context's trusted ones; false if there is none.
bool trust(SSL_CTX* context, const std::string& pem) {
  const Bio text(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
  bool any = false;
  while (text) {
    const Certificate next(PEM_read_bio_X509(text.get(), nullptr, no_password, nullptr));
    if (!next) break;
    any = X509_STORE_add_cert(SSL_CTX_get_cert_store(context), next.get()) == 1;
    if (!any) break;
  }
  // The end of the text is an error to OpenSSL.
  ERR_clear_error();
  return any;
}

/// Sets the client's certificate with those that follow it, and its key; false if they cannot be used.
bool show(SSL_CTX* context, const std::string& certificate, const std::string& key) {
  const Bio text(BIO_new_mem_buf(certificate.data(), static_cast<int>(certificate.size())));
  const Bio key_text(BIO_new_mem_buf(key.data(), static_cast<int>(key.size())));
  if (!text || !key_text) return false;
  const Certificate own(PEM_read_bio_X509(text.get(), nullptr, no_password, nullptr));
  const pairing::Key private_key(PEM_read_bio_PrivateKey(key_text.get(), nullptr, no_password, nullptr));
  if (!own || !private_key || SSL_CTX_use_certificate(context, own.get()) != 1 ||
      SSL_CTX_use_PrivateKey(context, private_key.get()) != 1 || SSL_CTX_check_private_key(context) != 1)
    return false;
  while (true) {
    const Certificate next(PEM_read_bio_X509(text.get(), nullptr, no_password, nullptr));
    if (!next) break;
    if (SSL_CTX_add1_chain_cert(context, next.get()) != 1) return false;
  }
  ERR_clear_error();
  return true;
}

}  // namespace

struct ClientTls::Parts {
  Context context;
  CertificateIdentity pinned;  ///< Unless `ca` is used.
  bool pins_key = false;
  std::string host;  ///< Unless a key is pinned.
};

ClientTls::ClientTls(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {
  // In place of OpenSSL's own verification, which the callback calls where there is an authority. libwebsockets sets a
  // callback of its own for single errors, which would accept some of them.
  SSL_CTX_set_cert_verify_callback(
      parts_->context.get(),
      [](X509_STORE_CTX* handshake, void* self) {
        auto* const tls = static_cast<ClientTls*>(self);
        X509_STORE_CTX_set_verify_cb(handshake, [](int ok, X509_STORE_CTX*) { return ok; });
        tls->rejection_ = tls->fault_of(handshake);
        if (tls->rejection_.empty()) {
          X509_STORE_CTX_set_error(handshake, X509_V_OK);
          return 1;
        }
        if (X509_STORE_CTX_get_error(handshake) == X509_V_OK)
          X509_STORE_CTX_set_error(handshake, X509_V_ERR_APPLICATION_VERIFICATION);
        return 0;
      },
      this);
}
ClientTls::~ClientTls() = default;

ssl_ctx_st* ClientTls::context() const { return parts_->context.get(); }

Result<std::unique_ptr<ClientTls>> ClientTls::make(const ClientTlsOptions& options) {
  auto parts = std::make_unique<Parts>();
  parts->context.reset(SSL_CTX_new(TLS_client_method()));
  SSL_CTX* const context = parts->context.get();
  if (context == nullptr || SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION) != 1)
    return Status(StatusCode::internal, "OpenSSL has no memory");
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER, nullptr);
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
  std::string trusted = options.ca;
  parts->host = options.host;
  if (!options.pinned.empty()) {
    const Result<CertificateIdentity> pinned = identify_certificate(options.pinned);
    if (!pinned.ok()) return Status(StatusCode::invalid_argument, "pinned: " + pinned.status().message());
    parts->pinned = *pinned;
    parts->pins_key = !pinned->is_authority;
    parts->host = kProbeHostName;
    trusted = pinned->pem;
  }
  if (!parts->pins_key && !trust(context, trusted))
    return Status(StatusCode::invalid_argument, "the trusted certificate cannot be read");
  if (!options.certificate.empty() && !show(context, options.certificate, options.key))
    return Status(StatusCode::invalid_argument, "the client's certificate and key cannot be read or do not match");
  return std::unique_ptr<ClientTls>(new ClientTls(std::move(parts)));
}

std::string ClientTls::fault_of(X509_STORE_CTX* handshake) const {
  const Result<CertificateIdentity> shown = identify_certificate(pem_of(X509_STORE_CTX_get0_cert(handshake)));
  if (!shown.ok()) return "the server presents no readable certificate";
  if (!shown->is_in_date) return "the certificate has expired, or is not valid yet by this machine's clock";
  if (!shown->is_server) return "the certificate is not for a server";
  if (shown->key_digest == parts_->pinned.key_digest) return {};
  if (parts_->pins_key) return "the certificate's key is not the pinned one";
  X509_VERIFY_PARAM* const rules = X509_STORE_CTX_get0_param(handshake);
  X509_VERIFY_PARAM_set_flags(rules, X509_V_FLAG_PARTIAL_CHAIN);
  X509_VERIFY_PARAM_set_hostflags(rules, X509_CHECK_FLAG_NO_PARTIAL_WILDCARDS);
  if (X509_VERIFY_PARAM_set1_ip_asc(rules, parts_->host.c_str()) != 1 &&
      X509_VERIFY_PARAM_set1_host(rules, parts_->host.c_str(), parts_->host.size()) != 1)
    return "OpenSSL has no memory";
  if (X509_verify_cert(handshake) == 1) return {};
  const int error = X509_STORE_CTX_get_error(handshake);
  if (error == X509_V_ERR_HOSTNAME_MISMATCH || error == X509_V_ERR_IP_ADDRESS_MISMATCH)
    return "the certificate is not valid for " + parts_->host;
  return std::string("the trusted authority did not issue the certificate (") + X509_verify_cert_error_string(error) +
         ")";
}

}  // namespace lightwell
