#include "link/web/web_authorizer.hpp"

namespace lightwell {

WebDecision WebAuthorizer::check(const WebRequest& request, std::string_view peer, std::string_view certificate,
                                 LateToken late_token, std::int64_t now_ns) {
  if (!is_origin_allowed(request.origin, request.host, allowed_origins_))
    return {403, "the page's origin is not this probe and not one of web.allowed_origins"};
  if (!calls_) {
    if (is_host_trusted(request.host, allowed_origins_)) return {};
    return {403,
            "in plain text, address the probe by its IP address or its name in .local, or name http://HOST:PORT in "
            "web.allowed_origins"};
  }
  if (!limit_.allows(peer, now_ns))
    return {429, "too many failed authentications from this address; wait a few seconds"};
  if (!request.has_authorization && certificate.empty() && late_token == LateToken::allowed)
    return {200, {}, WebAdmission::pending};
  const char* const denial = denial_reason(peer, {request.authorization, certificate}, now_ns);
  return denial == nullptr ? WebDecision{} : WebDecision{401, denial};
}

bool WebAuthorizer::accepts_token(std::string_view peer, const std::string& token, std::int64_t now_ns) {
  if (!calls_) return true;
  if (!limit_.allows(peer, now_ns)) return false;
  return denial_reason(peer, {"Bearer " + token, {}}, now_ns) == nullptr;
}

const char* WebAuthorizer::denial_reason(std::string_view peer, const CallCredentials& credentials,
                                         std::int64_t now_ns) {
  const char* const denial = calls_->denial_reason(credentials);
  if (denial != nullptr) limit_.count_failure(peer, now_ns);
  return denial;
}

}  // namespace lightwell
