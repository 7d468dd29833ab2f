// Credentials for grpcs:// probes: the client's trust anchors and its own identity.
#pragma once

#include <string>

#include <lightwell/result.hpp>

namespace lightwell {

/// All empty: looked up by address in the store of `lightwell pair`; if the store has a single probe, that one, because
/// a probe's address may change. Otherwise either `folder`, or one of `pinned` and `ca` with whatever else the probe
/// requires.
struct ProbeCredentials {
  /// Folder of one probe, as written by `lightwell pair`.
  std::string folder;
  /// PEM; the first certificate is used. Either the probe's own certificate, of which the public key is pinned (another
  /// certificate for the same key is accepted), or the probe's own authority; then the probe's certificate must be
  /// valid for probe.lightwell.internal. The address does not matter.
  std::string pinned;
  /// PEM: a certification authority of many hosts. The probe's certificate must be valid for the URI's host.
  std::string ca;
  /// PEM, both or neither.
  std::string client_certificate, client_key;
  /// Sent with every call, only after the probe's certificate was verified.
  std::string token;

  [[nodiscard]] bool empty() const;
  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

/// The folder in which `lightwell pair` stores a folder for each probe: $XDG_CONFIG_HOME/lightwell/probes, or
/// ~/.config/lightwell/probes. Empty if neither variable is set.
[[nodiscard]] std::string default_credential_store();

}  // namespace lightwell
