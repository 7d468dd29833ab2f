// Keys and certificates of the probe: its own, those of the authority that issues them, and the authority for clients.
// Certificates are X.509 on P-256; all keys and certificates are PEM.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>
#include <lightwell/secrets.hpp>

namespace lightwell {

/// Purpose of a certificate, stored in its key usage extensions, so that a client's certificate cannot authenticate a
/// probe.
enum class CertificateUse { authority, probe, client };

/// 2020-01-01. Certificates must be valid, too, for a board whose clock is years behind (no battery).
inline constexpr std::int64_t kDefaultNotBefore_s = 1'577'836'800;

struct CertificateRequest {
  CertificateUse use = CertificateUse::probe;
  std::string common_name;  ///< For people; truncated to 64 bytes.
  std::string public_key;   ///< SubjectPublicKeyInfo.
  std::int64_t not_before_s = kDefaultNotBefore_s;
  std::int64_t not_after_s = 0;  ///< Seconds since 1970.
};

struct CertifiedKey {
  std::string certificate, key;
};

/// An issuer with an empty certificate means self-signed with its key. invalid_argument: the key is not on P-256, or
/// the issuer's certificate or key cannot be read.
[[nodiscard]] Result<std::string> issue_certificate(const CertificateRequest& request, const CertifiedKey& issuer);

/// invalid_argument: `key` cannot be read or does not belong to `certificate`.
[[nodiscard]] Status check_key_matches_certificate(const std::string& certificate, const std::string& key);

/// The public key of a private key. data_loss: it cannot be read.
[[nodiscard]] Result<std::string> public_key_of(const std::string& private_key);

struct ProbeKeys {
  std::string certificate;  ///< The probe's certificate chain, sent in the TLS handshake.
  std::string key;
  std::string trust;      ///< The one certificate that a paired client pins: the probe's own authority, or the first
                          ///< certificate of the owner's file (the probe's).
  std::string client_ca;  ///< Authorities whose client certificates are accepted.
  /// Signs clients' certificates; empty if the owner's authority issues them.
  std::string issuer_certificate, issuer_key;
  std::string client_list;  ///< Path.

  /// Whether the probe issues client certificates; then a client must also be on the list.
  [[nodiscard]] bool issues_client_certificates() const { return !issuer_key.empty(); }
};

/// config.key_folder, or the default stated in config.proto. failed_precondition: no default, because neither a state
/// folder nor a home folder is known.
[[nodiscard]] Result<std::string> key_folder(const GrpcConfig& config);

/// Reads the keys; creates and stores missing ones: an authority valid for 20 years, and a certificate of the probe
/// valid for two, renewed by the same authority for the same key when less than a third of that is left. A folder lock
/// serialises processes. Errors name the file.
[[nodiscard]] Result<ProbeKeys> load_probe_keys(const GrpcConfig& config, std::string_view probe_name,
                                                std::int64_t now_s);

/// Seconds since 1970, UTC. Any thread.
using WallClock = std::function<std::int64_t()>;

/// The keys of a running probe: renews them when due, and reads the owner's files again when they change. Any thread.
class ReloadingKeys {
 public:
  ReloadingKeys(GrpcConfig config, std::string probe_name, WallClock clock);

  /// As load_probe_keys().
  [[nodiscard]] Result<ProbeKeys> load();
  /// The current keys if they differ from those of the last call. Checks the files at most once a minute.
  [[nodiscard]] std::optional<ProbeKeys> take_changed();
  /// Why the keys could not be renewed or read, empty without an error; the previous keys stay. Checks the files, too.
  [[nodiscard]] std::string error_message();

 private:
  /// The caller holds the mutex.
  void refresh();

  const GrpcConfig config_;
  const std::string probe_name_;
  const WallClock clock_;
  std::mutex mutex_;
  ProbeKeys keys_;
  bool changed_ = false;
  std::int64_t checked_s_ = 0;
  std::string error_message_;
};

/// The credentials that a client receives at pairing. The client list stores only their digests.
struct ClientCredentials {
  std::string token;
  std::string certificate;  ///< Empty if the owner's authority issues client certificates.
  std::int64_t expires_s = 0;
};
/// Issues credentials and adds the client to the list. `public_key`: PEM, P-256.
[[nodiscard]] Result<ClientCredentials> register_client(const ProbeKeys& keys, const std::string& name,
                                                        const std::string& public_key, int days, std::int64_t now_s);

}  // namespace lightwell
