#include "link/grpc/gatekeeper.hpp"

#include <ctime>
#include <string_view>

#include <grpc/grpc_security_constants.h>

#include <lightwell/secrets.hpp>

namespace lightwell {
namespace {

constexpr std::string_view kBearer = "Bearer ";
constexpr std::string_view kHealth = "/grpc.health.v1.Health/";

std::string_view value_of(const grpc::AuthMetadataProcessor::InputMetadata& metadata, const char* name) {
  const auto found = metadata.find(name);
  return found == metadata.end() ? std::string_view() : std::string_view(found->second.data(), found->second.size());
}

}  // namespace

bool Gatekeeper::admits_certificate(const grpc::AuthContext& context, std::int64_t now_s) const {
  // Here only where the handshake accepted it; a client need not show one.
  const std::vector<grpc::string_ref> shown = context.FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
  if (shown.empty()) return false;
  if (rule_ == CertificateRule::any) return true;
  const Result<std::string> digest = certificate_digest({shown.front().data(), shown.front().size()});
  return digest && clients_->admits_certificate(to_hex(*digest), now_s);
}

grpc::Status Gatekeeper::Process(const InputMetadata& metadata, grpc::AuthContext* context, OutputMetadata*,
                                 OutputMetadata*) {
  if (value_of(metadata, ":path").starts_with(kHealth)) return grpc::Status::OK;
  const std::int64_t now_s = std::time(nullptr);
  std::string_view token = value_of(metadata, "authorization");
  token = token.starts_with(kBearer) ? token.substr(kBearer.size()) : std::string_view();
  // Both are always looked at, so that the time tells nothing of which was there.
  const bool by_token = clients_->admits_token(token, now_s);
  const bool by_certificate = admits_certificate(*context, now_s);
  if (by_token || by_certificate) return grpc::Status::OK;
  refused_.fetch_add(1, std::memory_order_relaxed);
  return {grpc::StatusCode::UNAUTHENTICATED,
          "this probe knows its clients: pair with it (`lightwelld --pair` there, `lightwell pair` here), or show a "
          "token that "
          "is good"};
}

}  // namespace lightwell
