#include "link/access/link_access.hpp"

namespace lightwell {

Result<LinkAccess> LinkAccess::open(const GrpcConfig& config, const std::string& probe_name, const WallClock& clock) {
  LinkAccess out;
  out.keys = std::make_shared<ReloadingKeys>(config, probe_name, clock);
  const Result<ProbeKeys> keys = out.keys->load();
  if (!keys) return keys.status();
  out.clients = std::make_shared<ClientList>(keys->client_list);
  if (const Status s = out.clients->load(); !s.ok()) return s;
  out.authorizer = std::make_shared<CallAuthorizer>(
      out.clients, keys->issues_client_certificates() ? CertificatePolicy::listed : CertificatePolicy::any);
  return out;
}

std::string LinkAccess::error_message() const {
  const std::string of_keys = keys->error_message(), of_clients = clients->error_message();
  return of_keys + (of_keys.empty() || of_clients.empty() ? "" : "; ") + of_clients;
}

}  // namespace lightwell
