// Who the probe is to its clients: its certificate and key, the authority that vouches for it, and the one for clients.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// All PEM.
struct ProbeKeys {
  std::string certificate;  ///< What the probe shows, with the certificates that lead to its authority.
  std::string key;
  std::string trust;      ///< What a paired client pins, one certificate: the probe's own authority, or the first of
                          ///< the owner's file, which is the probe's own.
  std::string client_ca;  ///< Authorities of clients.
  /// Signs clients' certificates; empty where the owner's authority does that.
  std::string issuer_certificate, issuer_key;
  std::string client_list;  ///< Path.

  /// Whether a client must be on the list besides having a certificate.
  [[nodiscard]] bool issues_client_certificates() const { return !issuer_key.empty(); }
};

/// config.keys, or the default that config.proto states. failed_precondition where there is neither a state folder nor
/// a home.
[[nodiscard]] Result<std::string> key_folder(const GrpcConfig& config);

/// Reads the keys, or makes and keeps them: an authority that lives for 20 years, and a certificate of the probe for
/// two, made anew under the same authority and key when less than a third of that is left. Two processes that begin at
/// once agree. Errors name the file.
[[nodiscard]] Result<ProbeKeys> load_probe_keys(const GrpcConfig& config, std::string_view probe_name,
                                                std::int64_t now_s);

/// Seconds since 1970, UTC. Any thread.
using WallClock = std::function<std::int64_t()>;

/// The keys of a probe that serves: renewed, and read again where the owner's files changed, while it runs. Any thread.
class ReloadingKeys {
 public:
  ReloadingKeys(GrpcConfig config, std::string probe_name, WallClock clock);

  /// As load_probe_keys().
  [[nodiscard]] Result<ProbeKeys> load();
  /// Those to show from now on, where they are others than at the last call. Looks once a minute at most.
  [[nodiscard]] std::optional<ProbeKeys> take_changed();
  /// Why they could not be renewed or read, in which case those from before stay; empty: they could. Looks as well.
  [[nodiscard]] std::string error_message();

 private:
  /// The mutex is held.
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

/// A client as pairing makes it known: what it is told, once; the list keeps digests alone.
struct ClientCredentials {
  std::string token;
  std::string certificate;  ///< Empty where the owner's authority gives them out.
  std::int64_t expires_s = 0;
};
/// Puts it on the list. `public_key`: PEM, P-256.
[[nodiscard]] Result<ClientCredentials> register_client(const ProbeKeys& keys, const std::string& name,
                                             const std::string& public_key, int days, std::int64_t now_s);

}  // namespace lightwell
