// Makes a probe and this machine known to each other.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

struct PairOptions {
  /// Folder in which one is made for this probe. Empty: default_credential_store().
  std::string store{};
  /// Under what the probe lists this client. Empty: the host's name.
  std::string client_name{};
  /// For each of the two round trips.
  Duration timeout{10'000'000'000};
};

struct PairedProbe {
  std::string name;
  std::string folder;          ///< For ProbeCredentials::folder.
  std::string uri;             ///< Where its light is served; empty where the probe did not say.
  std::int64_t expires_s = 0;  ///< Seconds since 1970; from then on the pair must be made anew.
};

/// `uri`: grpcs://HOST or grpcs://HOST:PORT of a probe that waits (`lightwelld --pair`); `code`: the
/// six digits that it shows. Nobody who listens, or stands between and does not know the code,
/// learns or changes anything. The client's key is made here and does not leave this machine.
/// Blocks. invalid_argument: the URI or the code's form. failed_precondition: the code is wrong or
/// the window closed, as the probe says. unavailable: nobody answered. data_loss: the answer is not
/// from whoever knows the code; nothing was kept.
[[nodiscard]] Result<PairedProbe> pair_with_probe(std::string_view uri, std::string_view code,
                                                  const PairOptions& options = {});

}  // namespace lightwell
