// What a network link over TLS holds: the probe's keys, the list of clients, and the decision on each call.
#pragma once

#include <memory>
#include <string>

#include "link/access/call_authorizer.hpp"
#include "link/access/client_list.hpp"
#include "link/access/probe_keys.hpp"

namespace lightwell {

struct LinkAccess {
  std::shared_ptr<ReloadingKeys> keys;
  std::shared_ptr<ClientList> clients;
  std::shared_ptr<CallAuthorizer> authorizer;

  /// Reads or makes the keys and reads the list. Errors: those of load_probe_keys() and ClientList::load().
  [[nodiscard]] static Result<LinkAccess> open(const GrpcConfig& config, const std::string& probe_name,
                                               const WallClock& clock);
  /// The present fault of the keys' files or of the list, empty without one. Checks the files.
  [[nodiscard]] std::string error_message() const;
};

}  // namespace lightwell
