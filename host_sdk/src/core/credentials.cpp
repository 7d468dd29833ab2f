#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <utility>

#include <lightwell/credentials.hpp>

namespace lightwell {
namespace {

constexpr std::string_view kCertificate = "-----BEGIN CERTIFICATE-----";

}  // namespace

bool ProbeCredentials::empty() const {
  return folder.empty() && pinned.empty() && ca.empty() && client_certificate.empty() && client_key.empty() &&
         token.empty();
}

Status ProbeCredentials::validate() const {
  const auto refused = [](std::string_view what) {
    return Status(StatusCode::invalid_argument, "ProbeCredentials: " + std::string(what));
  };
  if (empty()) return {};
  const bool more =
      !pinned.empty() || !ca.empty() || !client_certificate.empty() || !client_key.empty() || !token.empty();
  if (!folder.empty()) return more ? refused("folder replaces all other fields; leave them empty") : Status();
  if (pinned.empty() == ca.empty()) return refused("exactly one of pinned and ca must be set");
  for (const auto& [pem, name] :
       {std::pair(&pinned, "pinned"), std::pair(&ca, "ca"), std::pair(&client_certificate, "client_certificate")})
    if (!pem->empty() && pem->find(kCertificate) == std::string::npos)
      return refused(std::string(name) + " is not a certificate in PEM form");
  if (client_certificate.empty() != client_key.empty())
    return refused("client_certificate and client_key must be given together");
  if (std::any_of(token.begin(), token.end(), [](char c) { return c <= ' ' || c > '~'; }))
    return refused("token has a space or a character that is not ASCII");
  return {};
}

std::string default_credential_store() {
  const auto set = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string(value == nullptr ? "" : value);
  };
  if (const std::string config = set("XDG_CONFIG_HOME"); !config.empty()) return config + "/lightwell/probes";
  if (const std::string home = set("HOME"); !home.empty()) return home + "/.config/lightwell/probes";
  return {};
}

}  // namespace lightwell
