// The folders that pairing writes, one for each probe, of plain files that other tools can read:
//   probe_ca.pem   client.pem   client_key.pem   token   name   address
#pragma once

#include <string>

#include <lightwell/credentials.hpp>
#include <lightwell/result.hpp>

#include "core/uri.hpp"

namespace lightwell::core {

/// With the files read, so that `folder` is empty. not_found, with the remedy, where TLS is asked for
/// and nothing is known of the probe; invalid_argument where credentials would go over plain text.
[[nodiscard]] Result<ProbeCredentials> credentials_for(const ProbeCredentials& given, const GrpcAddress& address);

/// What pairing brought.
struct PairedFiles {
  ProbeCredentials credentials;  ///< pinned, and the client's.
  std::string name;
  std::string address;  ///< host:port of its light; empty: not known.
};

/// Returns the folder, named after the pinned certificate, so that a probe paired again replaces
/// itself. It is there whole or not at all, and for its owner alone. An address belongs to the probe
/// that was paired with last.
[[nodiscard]] Result<std::string> keep_credentials(const std::string& store, const PairedFiles& files);

}  // namespace lightwell::core
