#include "link/access/probe_keys.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>

#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <lightwell/deleter.hpp>
#include <lightwell/files.hpp>

#include "link/access/client_list.hpp"
#include "link/access/openssl.hpp"

namespace lightwell {
namespace {

using access::Bio;
using access::Certificate;
using access::Key;
using access::no_password;
using access::reader_of;
using BigNumber = std::unique_ptr<BIGNUM, Deleter<BN_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, Deleter<X509_EXTENSION_free>>;

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

constexpr std::int64_t kDay_s = 86'400;
/// Interval between checks of the keys of a running probe.
constexpr std::int64_t kCheckPeriod_s = 60;
constexpr std::int64_t kAuthorityDays = 20 * 365, kProbeDays = 2 * 365;

/// Expiry `days` from now; a clock before kDefaultNotBefore_s counts as that date, so that certificates of a board
/// whose clock is behind do not expire too early.
std::int64_t days_from(std::int64_t now_s, std::int64_t days) {
  return std::max(now_s, kDefaultNotBefore_s) + days * kDay_s;
}

/// The text of the file; if it does not exist, the result of `make`, which is written to it.
Result<std::string> read_or_create(const std::string& path, const std::function<Result<std::string>()>& make) {
  Result<std::optional<std::string>> text = read_private_file(path);
  if (!text) return text.status();
  if (*text) return std::move(**text);
  Result<std::string> made = make();
  if (!made) return made;
  if (const Status s = write_atomically(path, *made, FileMode::owner); !s.ok()) return s;
  return made;
}

Result<std::string> new_private_key() {
  Result<KeyPair> made = KeyPair::make();
  if (!made) return made.status();
  return std::move(made->private_pem);
}

/// Key and certificate STEM_key.pem and STEM.pem; creates missing ones, and renews a certificate that expires at
/// `renew_s` or before. Without `issuer`, self-signed.
Result<CertifiedKey> load_or_create(const std::string& stem, CertificateRequest request,
                                    const std::optional<CertifiedKey>& issuer, std::int64_t renew_s) {
  const std::string key_path = stem + "_key.pem", path = stem + ".pem";
  const Result<std::string> key = read_or_create(key_path, new_private_key);
  if (!key) return key.status();
  if (const Status s = public_key_of(*key).assign_to(request.public_key); !s.ok()) return s.in(key_path);
  const auto issue = [&] { return issue_certificate(request, issuer ? *issuer : CertifiedKey{{}, *key}); };
  Result<std::string> certificate = read_or_create(path, issue);
  if (!certificate) return certificate.status();
  const Result<CertificateIdentity> present = identify_certificate(*certificate);
  if (!present) return present.status().in(path);
  if (present->expires_s == 0)
    return Status(StatusCode::data_loss, path + ": the certificate's expiry date cannot be read");
  if (present->expires_s <= renew_s) {
    certificate = issue();
    if (!certificate) return certificate.status();
    if (const Status s = write_atomically(path, *certificate, FileMode::owner); !s.ok()) return s;
  }
  if (const Status s = check_key_matches_certificate(*certificate, *key); !s.ok()) return s.in(path);
  return CertifiedKey{*certificate, *key};
}

Result<std::string> read_named(const std::string& path, const char* field) {
  Result<std::optional<std::string>> text = read_named_file(path);
  if (!text) return text.status();
  if (!*text) return Status(StatusCode::not_found, path + ": there is no such file; correct " + field);
  return std::move(**text);
}

/// Replaces the probe's own keys and authorities by the owner's files, where the configuration names them.
Status apply_owner_files(const GrpcConfig& config, ProbeKeys& keys) {
  if (!config.certificate.empty()) {
    if (Status s = read_named(config.certificate, "grpc.certificate").assign_to(keys.certificate); !s.ok()) return s;
    if (Status s = read_named(config.key, "grpc.key").assign_to(keys.key); !s.ok()) return s;
    if (const Status s = check_key_matches_certificate(keys.certificate, keys.key); !s.ok())
      return s.in(config.certificate + ", " + config.key);
    // Clients pin only the first certificate, because the authorities after it also sign certificates of others.
    Result<CertificateIdentity> own = identify_certificate(keys.certificate);
    if (!own) return own.status().in(config.certificate);
    keys.trust = std::move(own->pem);
  }
  if (!config.client_ca.empty()) {
    if (Status s = read_named(config.client_ca, "grpc.client_ca").assign_to(keys.client_ca); !s.ok()) return s;
    if (const Status s = identify_certificate(keys.client_ca).status(); !s.ok()) return s.in(config.client_ca);
    keys.issuer_certificate.clear();
    keys.issuer_key.clear();
  }
  return {};
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

Result<std::string> key_folder(const GrpcConfig& config) {
  if (!config.key_folder.empty()) return config.key_folder;
  const auto variable = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string(value == nullptr ? "" : value);
  };
  // systemd separates several directories with colons.
  if (const std::string state = variable("STATE_DIRECTORY"); !state.empty())
    return state.substr(0, state.find(':')) + "/keys";
  if (const std::string state = variable("XDG_STATE_HOME"); !state.empty()) return state + "/lightwell";
  if (const std::string home = variable("HOME"); !home.empty()) return home + "/.local/state/lightwell";
  return Status(StatusCode::failed_precondition,
                "the probe's keys have no folder: STATE_DIRECTORY, XDG_STATE_HOME and HOME are not set; name one with "
                "grpc.key_folder or --keys");
}

Result<ProbeKeys> load_probe_keys(const GrpcConfig& config, std::string_view probe_name, std::int64_t now_s) {
  const Result<std::string> folder = key_folder(config);
  if (!folder) return folder.status();
  if (const Status s = make_private_folder(*folder); !s.ok()) return s;
  const Result<FolderLock> lock = FolderLock::take(*folder);
  if (!lock) return lock.status();
  ProbeKeys keys;
  keys.client_list = *folder + "/clients";

  CertificateRequest request;
  request.use = CertificateUse::authority;
  request.common_name = std::string(probe_name) + " authority";
  request.not_after_s = days_from(now_s, kAuthorityDays);
  // The authority is not renewed automatically: every client would have to be paired again.
  Result<CertifiedKey> authority = load_or_create(*folder + "/ca", request, std::nullopt, 0);
  if (!authority) return authority.status();
  request.use = CertificateUse::probe;
  request.common_name = std::string(probe_name);
  request.not_after_s = days_from(now_s, kProbeDays);
  const Result<CertifiedKey> probe =
      load_or_create(*folder + "/probe", request, *authority, now_s + kProbeDays * kDay_s / 3);
  if (!probe) return probe.status();
  keys.certificate = probe->certificate;
  keys.key = probe->key;
  keys.trust = keys.client_ca = keys.issuer_certificate = authority->certificate;
  keys.issuer_key = authority->key;
  if (const Status s = apply_owner_files(config, keys); !s.ok()) return s;
  return keys;
}

ReloadingKeys::ReloadingKeys(GrpcConfig config, std::string probe_name, WallClock clock)
    : config_(std::move(config)), probe_name_(std::move(probe_name)), clock_(std::move(clock)) {}

Result<ProbeKeys> ReloadingKeys::load() {
  const std::lock_guard lock(mutex_);
  checked_s_ = clock_();
  Result<ProbeKeys> keys = load_probe_keys(config_, probe_name_, checked_s_);
  if (!keys) return keys;
  keys_ = *keys;
  changed_ = true;
  return keys;
}

void ReloadingKeys::refresh() {
  // Checks at once if the clock was set, in either direction: a certificate may have expired.
  const std::int64_t now_s = clock_();
  if (now_s >= checked_s_ && now_s < checked_s_ + kCheckPeriod_s) return;
  checked_s_ = now_s;
  const std::string authority = std::filesystem::path(keys_.client_list).parent_path().string() + "/ca_key.pem";
  std::error_code error;
  // Without this file load_probe_keys() would create a new authority that no client trusts; only a start does that.
  Result<ProbeKeys> keys =
      std::filesystem::exists(authority, error)
          ? load_probe_keys(config_, probe_name_, now_s)
          : Status(StatusCode::not_found, authority +
                                              ": the probe's key is missing; restore it, or restart the probe, "
                                              "which creates a new one, and pair its clients again");
  error_message_ = keys ? std::string() : keys.status().message() + " (until then the previous keys are used)";
  if (!keys || (keys->certificate == keys_.certificate && keys->key == keys_.key && keys->client_ca == keys_.client_ca))
    return;
  keys_ = std::move(*keys);
  changed_ = true;
}

std::optional<ProbeKeys> ReloadingKeys::take_changed() {
  const std::lock_guard lock(mutex_);
  refresh();
  if (!std::exchange(changed_, false)) return std::nullopt;
  return keys_;
}

std::string ReloadingKeys::error_message() {
  const std::lock_guard lock(mutex_);
  refresh();
  return error_message_;
}

Result<ClientCredentials> register_client(const ProbeKeys& keys, const std::string& name, const std::string& public_key,
                                          int days, std::int64_t now_s) {
  const Result<std::string> secret = random_bytes(32);
  if (!secret) return secret.status();
  ClientCredentials client;
  client.token = to_base64url(*secret);
  client.expires_s = days_from(now_s, days);
  ClientEntry entry{to_hex(sha256(client.token)), {}, client.expires_s, name};
  if (keys.issues_client_certificates()) {
    Result<std::string> certificate =
        issue_certificate({CertificateUse::client, "client", public_key, kDefaultNotBefore_s, client.expires_s},
                          {keys.issuer_certificate, keys.issuer_key});
    if (!certificate) return certificate.status();
    const Result<std::string> digest = certificate_digest(*certificate);
    if (!digest) return digest.status();
    entry.certificate_digest = to_hex(*digest);
    client.certificate = std::move(*certificate);
  }
  const Result<FolderLock> lock = FolderLock::take(std::filesystem::path(keys.client_list).parent_path().string());
  if (!lock) return lock.status();
  if (const Status s = ClientList::add(keys.client_list, std::move(entry), now_s); !s.ok()) return s;
  return client;
}

}  // namespace lightwell
