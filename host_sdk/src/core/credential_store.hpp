// The credential store: one folder per paired probe, of plain files that other tools can read:
//   probe_ca.pem   client.pem   client_key.pem   token   name   address
#pragma once

#include <string>

#include <lightwell/credentials.hpp>
#include <lightwell/result.hpp>

#include "core/uri.hpp"

namespace lightwell::core {

/// The credentials with the files of `folder` or of the store read (`folder` is then empty). not_found, with the
/// remedy, if the address uses TLS and there are no credentials for the probe; invalid_argument if credentials would be
/// sent in plain text.
[[nodiscard]] Result<ProbeCredentials> credentials_for(const ProbeCredentials& given, const GrpcAddress& address);
/// Pairing stores the address of the probe's gRPC link, so those of the same host count.
[[nodiscard]] Result<ProbeCredentials> credentials_for(const ProbeCredentials& given, const WebAddress& address);

/// The result of a pairing.
struct PairedFiles {
  ProbeCredentials credentials;  ///< `pinned`, and the client's.
  std::string name;
  std::string address;  ///< host:port of its lighting service; empty: not known.
};

/// Stores the files and returns their folder, which is named after the pinned certificate, so that pairing again
/// replaces it. It is created atomically and accessible to its owner only. If several probes had the same address, it
/// is that of the last paired one.
[[nodiscard]] Result<std::string> keep_credentials(const std::string& store, const PairedFiles& files);

}  // namespace lightwell::core
