#include "link/access/probe_keys.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>
#include <system_error>
#include <utility>

#include <lightwell/files.hpp>
#include <lightwell/secrets.hpp>

#include "link/access/certificate.hpp"
#include "link/access/client_list.hpp"

namespace lightwell {
namespace {

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
