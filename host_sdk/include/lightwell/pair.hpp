// Pairing: a probe and this machine exchange certificates, authenticated by a six-digit code.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

struct PairOptions {
  /// Credential store: the folder in which a folder for this probe is created. Empty: default_credential_store().
  std::string store{};
  /// Name of this client in the probe's list. Empty: the host name.
  std::string client_name{};
  /// Limit of each of the two round trips.
  Duration timeout{10'000'000'000};
};

struct PairedProbe {
  std::string name;
  std::string folder;          ///< For ProbeCredentials::folder.
  std::string uri;             ///< Address of its lighting service; empty if the probe did not report it.
  std::int64_t expires_s = 0;  ///< Expiry of the client certificate, seconds since 1970; pair again before that.
};

/// `uri`: grpcs://HOST or grpcs://HOST:PORT of a probe in pairing mode (`lightwelld --pair`); `code`: the six digits
/// that it shows. SPAKE2 (RFC 9382) protects against eavesdroppers and against a man in the middle who does not know
/// the code. The client's private key is generated here and does not leave this machine. Blocks. invalid_argument: the
/// URI or the form of the code. failed_precondition: the probe reports a wrong code or a closed pairing window, or the
/// SDK was built without gRPC. unavailable: no response. data_loss: the response is not from a peer that knows the
/// code; nothing was stored.
[[nodiscard]] Result<PairedProbe> pair_with_probe(std::string_view uri, std::string_view code,
                                                  const PairOptions& options = {});

}  // namespace lightwell
