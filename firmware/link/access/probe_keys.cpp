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
/// Of keys that are in use.
constexpr std::int64_t kCheckPeriod_s = 60;
constexpr std::int64_t kAuthorityDays = 20 * 365, kProbeDays = 2 * 365;

/// A board whose clock is behind makes certificates that last as long as if it were right at the least.
std::int64_t days_from(std::int64_t now_s, std::int64_t days) { return std::max(now_s, kDefaultNotBefore_s) + days * kDay_s; }

/// The file's text, or what `make` gives, kept.
Result<std::string> kept(const std::string& path, const std::function<Result<std::string>()>& make) {
  Result<std::optional<std::string>> there = read_private_file(path);
  if (!there) return there.status();
  if (*there) return std::move(**there);
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

Status at(const std::string& path, const Status& s) { return s.ok() ? s : Status(s.code(), path + ": " + s.message()); }

/// Key and certificate of one kind, from the folder or new.
struct Held {
  std::string certificate, key;
};
Result<Held> held(const std::string& stem, CertificateRequest order, const std::optional<Issuer>& issuer,
                  std::int64_t renew_s) {
  const std::string key_path = stem + "_key.pem", path = stem + ".pem";
  const Result<std::string> key = kept(key_path, new_private_key);
  if (!key) return key.status();
  Result<std::string> open = public_key_of(*key);
  if (!open) return at(key_path, open.status());
  order.public_key = std::move(*open);
  const auto issue = [&] { return issue_certificate(order, issuer ? *issuer : Issuer{{}, *key}); };
  Result<std::string> certificate = kept(path, issue);
  if (!certificate) return certificate.status();
  const Result<CertificateInfo> facts = read_certificate(*certificate);
  if (!facts) return at(path, facts.status());
  if (facts->not_after_s <= renew_s) {
    certificate = issue();
    if (!certificate) return certificate.status();
    if (const Status s = write_atomically(path, *certificate, FileMode::owner); !s.ok()) return s;
  }
  if (const Status s = at(path, check_key_matches_certificate(*certificate, *key)); !s.ok()) return s;
  return Held{*certificate, *key};
}

Result<std::string> read_named(const std::string& path, const char* field) {
  Result<std::optional<std::string>> text = read_named_file(path);
  if (!text) return text.status();
  if (!*text) return Status(StatusCode::not_found, path + ": there is no such file, which " + field + " names");
  return std::move(**text);
}

/// The owner's own files in place of the probe's.
Status take_owners(const GrpcConfig& config, ProbeKeys& keys) {
  if (!config.certificate.empty()) {
    Result<std::string> certificate = read_named(config.certificate, "grpc.certificate");
    if (!certificate) return certificate.status();
    Result<std::string> key = read_named(config.key, "grpc.key");
    if (!key) return key.status();
    if (const Status s = at(config.certificate + ", " + config.key, check_key_matches_certificate(*certificate, *key)); !s.ok())
      return s;
    // Clients pin this certificate alone. Those that follow in the file vouch for others, too.
    Result<CertificateIdentity> own = identify_certificate(*certificate);
    if (!own) return at(config.certificate, own.status());
    keys.trust = std::move(own->pem);
    keys.certificate = std::move(*certificate);
    keys.key = std::move(*key);
  }
  if (!config.client_ca.empty()) {
    Result<std::string> ca = read_named(config.client_ca, "grpc.client_ca");
    if (!ca) return ca.status();
    if (const Result<CertificateInfo> facts = read_certificate(*ca); !facts)
      return at(config.client_ca, facts.status());
    keys.client_ca = std::move(*ca);
    keys.issuer_certificate.clear();
    keys.issuer_key.clear();
  }
  return {};
}

}  // namespace

Result<std::string> key_folder(const GrpcConfig& config) {
  if (!config.keys.empty()) return config.keys;
  const auto set = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string(value == nullptr ? "" : value);
  };
  // systemd may name several, with colons between.
  if (const std::string state = set("STATE_DIRECTORY"); !state.empty())
    return state.substr(0, state.find(':')) + "/keys";
  if (const std::string state = set("XDG_STATE_HOME"); !state.empty()) return state + "/lightwell";
  if (const std::string home = set("HOME"); !home.empty()) return home + "/.local/state/lightwell";
  return Status(StatusCode::failed_precondition,
                "there is no place for the probe's keys: name a folder with grpc.keys or --keys");
}

Result<ProbeKeys> load_probe_keys(const GrpcConfig& config, std::string_view probe_name, std::int64_t now_s) {
  const Result<std::string> folder = key_folder(config);
  if (!folder) return folder.status();
  if (const Status s = make_private_folder(*folder); !s.ok()) return s;
  const Result<FolderLock> lock = FolderLock::take(*folder);
  if (!lock) return lock.status();
  ProbeKeys keys;
  keys.client_list = *folder + "/clients";

  CertificateRequest order;
  order.use = CertificateUse::authority;
  order.common_name = std::string(probe_name) + " authority";
  order.not_after_s = days_from(now_s, kAuthorityDays);
  // Never renewed by itself: every client would have to be paired again, which is for people to decide.
  Result<Held> authority = held(*folder + "/ca", order, std::nullopt, 0);
  if (!authority) return authority.status();
  order.use = CertificateUse::probe;
  order.common_name = std::string(probe_name);
  order.not_after_s = days_from(now_s, kProbeDays);
  const Result<Held> probe =
      held(*folder + "/probe", order, Issuer{authority->certificate, authority->key}, now_s + kProbeDays * kDay_s / 3);
  if (!probe) return probe.status();
  keys.certificate = probe->certificate;
  keys.key = probe->key;
  keys.trust = keys.client_ca = keys.issuer_certificate = authority->certificate;
  keys.issuer_key = authority->key;
  if (const Status s = take_owners(config, keys); !s.ok()) return s;
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
  // A clock that was set, in either direction, is a reason to look at once: a certificate may have expired by it.
  const std::int64_t now_s = clock_();
  if (now_s >= checked_s_ && now_s < checked_s_ + kCheckPeriod_s) return;
  checked_s_ = now_s;
  const std::string authority = std::filesystem::path(keys_.client_list).parent_path().string() + "/ca_key.pem";
  std::error_code error;
  // Without it, loading would make a new authority, which no client knows: that is for a start to do.
  Result<ProbeKeys> keys =
      std::filesystem::exists(authority, error)
          ? load_probe_keys(config_, probe_name_, now_s)
          : Status(StatusCode::not_found, authority +
                                              ": the probe's key is gone; bring it back, or start the probe "
                                              "anew, which makes another, and pair its clients again");
  error_message_ = keys ? std::string() : keys.status().message() + " (until then the keys from before are used)";
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

Result<ClientCredentials> register_client(const ProbeKeys& keys, const std::string& name, const std::string& public_key, int days,
                               std::int64_t now_s) {
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
