// Of an SDK without TLS.
#include "doctor/machine_checks.hpp"
#include "doctor/probe_checks.hpp"

namespace lightwell::tool {
namespace {

Finding without_tls() {
  return not_checked("this SDK was built without TLS", "install libgrpc++-dev or libwebsockets-dev and build it again");
}

}  // namespace

Finding check_credential_store(const std::string&) { return without_tls(); }
Finding check_credentials(const std::string&, const ProbeCredentials&) { return without_tls(); }

}  // namespace lightwell::tool
