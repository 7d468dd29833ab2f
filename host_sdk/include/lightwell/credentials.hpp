// Whom a client trusts, and who it is: what a grpcs:// probe wants to know.
#pragma once

#include <string>

#include <lightwell/result.hpp>

namespace lightwell {

/// All empty: looked up among the probes that `lightwell pair` wrote, by address; where it wrote one
/// alone, that one, for a probe's address may change. Otherwise either `folder`, or one of `pinned`
/// and `ca` with what else the probe asks for.
struct ProbeCredentials {
  /// Folder of one probe, as `lightwell pair` writes it.
  std::string folder;
  /// PEM; the first certificate counts. The probe's own: whoever holds its key is the probe, also with another
  /// certificate for this key. Or the probe's own authority: the certificate must name probe.lightwell.internal. The
  /// address does not matter.
  std::string pinned;
  /// PEM: an authority that vouches for many. The certificate must name the URI's host.
  std::string ca;
  /// PEM, both or neither.
  std::string client_certificate, client_key;
  /// Sent with every call, only after the probe's certificate was found good.
  std::string token;

  [[nodiscard]] bool empty() const;
  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

/// Where `lightwell pair` keeps a folder for each probe: $XDG_CONFIG_HOME/lightwell/probes, or
/// ~/.config/lightwell/probes. Empty where there is neither.
[[nodiscard]] std::string default_credential_store();

}  // namespace lightwell
