// Who the probe is to its clients: its certificate and key, the authority that vouches for it, and the one for clients.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// All PEM.
struct ProbeKeys {
  std::string certificate;  ///< What the probe shows, with the certificates that lead to its authority.
  std::string key;
  std::string trust;      ///< What a paired client pins: the probe's own authority, or the owner's certificate.
  std::string client_ca;  ///< Authorities of clients.
  /// Signs clients' certificates; empty where the owner's authority does that.
  std::string issuer_certificate, issuer_key;
  std::string client_list;  ///< Path.

  /// Whether a client must be on the list besides having a certificate.
  [[nodiscard]] bool own_clients() const { return !issuer_key.empty(); }
};

/// config.keys, or the default that config.proto states. failed_precondition where there is neither a state folder nor
/// a home.
[[nodiscard]] Result<std::string> key_folder(const GrpcConfig& config);

/// Reads the keys, or makes and keeps them: an authority that lives for 20 years, and a certificate of the probe for
/// two, made anew under the same authority and key when less than a third of that is left. Two processes that begin at
/// once agree. Errors name the file.
[[nodiscard]] Result<ProbeKeys> load_probe_keys(const GrpcConfig& config, std::string_view probe_name,
                                                std::int64_t now_s);

/// A client as pairing makes it known: what it is told, once; the list keeps digests alone.
struct NewClient {
  std::string token;
  std::string certificate;  ///< Empty where the owner's authority gives them out.
  std::int64_t expires_s = 0;
};
/// Puts it on the list. `public_key`: PEM, P-256.
[[nodiscard]] Result<NewClient> admit_client(const ProbeKeys& keys, const std::string& name,
                                             const std::string& public_key, int days, std::int64_t now_s);

}  // namespace lightwell
