#include "link/access/server_tls.hpp"

#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>

#include <lightwell/deleter.hpp>

#include "link/access/openssl.hpp"

namespace lightwell {
namespace {

using access::Bio;
using access::Certificate;
using access::no_password;
using access::reader_of;
using TrustStore = std::unique_ptr<X509_STORE, Deleter<X509_STORE_free>>;

std::vector<Certificate> read_certificates(std::string_view pem) {
  std::vector<Certificate> out;
  const Bio text = reader_of(pem);
  while (text) {
    Certificate next(PEM_read_bio_X509(text.get(), nullptr, no_password, nullptr));
    if (!next) break;
    out.push_back(std::move(next));
  }
  // The end of the text is an error to OpenSSL.
  ERR_clear_error();
  return out;
}

}  // namespace

struct ServerTls::Keys {
  std::vector<Certificate> chain;        ///< The probe's certificate first.
  std::vector<Certificate> authorities;  ///< Of clients.
  access::Key key;
  TrustStore trust;  ///< `authorities`.

  /// Null if OpenSSL cannot read them.
  [[nodiscard]] static std::unique_ptr<Keys> read(const ProbeKeys& keys) {
    auto out = std::make_unique<Keys>();
    out->chain = read_certificates(keys.certificate);
    out->authorities = read_certificates(keys.client_ca);
    const Bio text = reader_of(keys.key);
    if (text) out->key.reset(PEM_read_bio_PrivateKey(text.get(), nullptr, no_password, nullptr));
    out->trust.reset(X509_STORE_new());
    if (out->chain.empty() || out->authorities.empty() || !out->key || !out->trust) return nullptr;
    for (const Certificate& authority : out->authorities)
      if (X509_STORE_add_cert(out->trust.get(), authority.get()) != 1) return nullptr;
    return out;
  }
};

ServerTls::ServerTls(std::shared_ptr<ReloadingKeys> source, ClientCertificates clients)
    : source_(std::move(source)), clients_(clients) {}
ServerTls::~ServerTls() = default;

Result<std::unique_ptr<ServerTls>> ServerTls::make(std::shared_ptr<ReloadingKeys> keys, ClientCertificates clients) {
  const Result<ProbeKeys> loaded = keys->load();
  if (!loaded) return loaded.status();
  std::unique_ptr<ServerTls> out(new ServerTls(std::move(keys), clients));
  out->keys_ = Keys::read(*loaded);
  if (!out->keys_)
    return Status(StatusCode::data_loss,
                  "the probe's certificate, its key or the clients' authority is not usable PEM");
  return out;
}

bool ServerTls::configure(ssl_ctx_st* context) {
  SSL_CTX_set_options(context, SSL_OP_NO_TICKET | SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION);
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_verify(context,
                     SSL_VERIFY_PEER | (clients_ == ClientCertificates::required ? SSL_VERIFY_FAIL_IF_NO_PEER_CERT : 0),
                     nullptr);
  SSL_CTX_set_cert_cb(
      context, [](SSL* connection, void* self) { return static_cast<ServerTls*>(self)->use_current_keys(connection); },
      this);
  return SSL_CTX_set_num_tickets(context, 0) == 1 && SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION) == 1;
}

int ServerTls::use_current_keys(ssl_st* connection) {
  if (const std::optional<ProbeKeys> changed = source_->take_changed())
    if (std::unique_ptr<Keys> usable = Keys::read(*changed)) keys_ = std::move(usable);
  SSL_certs_clear(connection);
  if (SSL_use_certificate(connection, keys_->chain.front().get()) != 1 ||
      SSL_use_PrivateKey(connection, keys_->key.get()) != 1 ||
      SSL_set1_verify_cert_store(connection, keys_->trust.get()) != 1)
    return 0;
  for (std::size_t i = 1; i < keys_->chain.size(); ++i)
    if (SSL_add1_chain_cert(connection, keys_->chain[i].get()) != 1) return 0;
  STACK_OF(X509_NAME)* const names = sk_X509_NAME_new_null();
  if (names == nullptr) return 0;
  for (const Certificate& authority : keys_->authorities)
    if (X509_NAME* const name = X509_NAME_dup(X509_get_subject_name(authority.get()))) sk_X509_NAME_push(names, name);
  SSL_set_client_CA_list(connection, names);
  return 1;
}

std::string ServerTls::client_certificate(const ssl_st* connection) {
  const Certificate shown(SSL_get1_peer_certificate(connection));
  const Bio text(BIO_new(BIO_s_mem()));
  if (!shown || !text || SSL_get_verify_result(connection) != X509_V_OK ||
      PEM_write_bio_X509(text.get(), shown.get()) != 1)
    return {};
  char* begin = nullptr;
  const long length = BIO_get_mem_data(text.get(), &begin);
  return {begin, static_cast<std::size_t>(length)};
}

}  // namespace lightwell
