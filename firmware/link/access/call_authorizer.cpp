#include "link/access/call_authorizer.hpp"

#include <ctime>

#include <lightwell/secrets.hpp>

namespace lightwell {
namespace {

constexpr std::string_view kBearer = "Bearer ";

}  // namespace

bool CallAuthorizer::accepts_certificate(std::string_view pem, std::int64_t now_s) const {
  if (pem.empty()) return false;
  if (policy_ == CertificatePolicy::any) return true;
  const Result<std::string> digest = certificate_digest(pem);
  return digest && clients_->accepts_certificate(to_hex(*digest), now_s);
}

const char* CallAuthorizer::denial_reason(const CallCredentials& call) {
  const std::int64_t now_s = std::time(nullptr);
  const std::string_view token =
      call.authorization.starts_with(kBearer) ? call.authorization.substr(kBearer.size()) : std::string_view();
  // Both are always evaluated, so that the time does not reveal which of them the call had.
  const bool by_token = clients_->accepts_token(token, now_s);
  const bool by_certificate = accepts_certificate(call.certificate, now_s);
  if (by_token || by_certificate) return nullptr;
  refused_.fetch_add(1, std::memory_order_relaxed);
  return "the call has no valid token or certificate of this probe: pair with it (`lightwelld --pair` there, "
         "`lightwell pair` here)";
}

}  // namespace lightwell
