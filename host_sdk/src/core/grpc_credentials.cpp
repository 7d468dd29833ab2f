#include "core/grpc_credentials.hpp"

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_certificate_verifier.h>
#include <grpcpp/security/tls_credentials_options.h>

#include <lightwell/secrets.hpp>

namespace lightwell::core {
namespace {

using grpc::experimental::IdentityKeyCertPair;
using grpc::experimental::StaticDataCertificateProvider;
using grpc::experimental::TlsChannelCredentialsOptions;

/// Runs after the TLS handshake, in which the server proved possession of the certificate's key, and before any call is
/// sent.
class PinVerifier final : public grpc::experimental::ExternalCertificateVerifier {
 public:
  explicit PinVerifier(CertificateIdentity pinned) : pinned_(std::move(pinned)) {}

  bool Verify(grpc::experimental::TlsCustomVerificationCheckRequest* request, std::function<void(grpc::Status)>,
              grpc::Status* result) override {
    const std::string fault = fault_of(*request);
    *result = fault.empty() ? grpc::Status::OK : grpc::Status(grpc::StatusCode::UNAUTHENTICATED, fault);
    return true;
  }
  void Cancel(grpc::experimental::TlsCustomVerificationCheckRequest*) override {}

 private:
  [[nodiscard]] std::string fault_of(const grpc::experimental::TlsCustomVerificationCheckRequest& request) const {
    const grpc::string_ref peer = request.peer_cert();
    const Result<CertificateIdentity> shown = identify_certificate({peer.data(), peer.size()});
    if (!shown.ok()) return "the server presents no readable certificate";
    if (!shown->is_in_date) return "the certificate has expired, or is not valid yet by this machine's clock";
    if (!shown->is_server) return "the certificate is not for a server";
    if (shown->key_digest == pinned_.key_digest) return {};
    if (!pinned_.is_authority) return "the certificate's key is not the pinned one";
    const std::vector<grpc::string_ref> names = request.dns_names();
    if (std::find(names.begin(), names.end(), kProbeHostName) != names.end()) return {};
    return std::string("the pinned authority issued the certificate, but it is not valid for ") + kProbeHostName +
           ": pin the probe's own certificate, or use the authority as `ca`, for the host name in the certificate";
  }

  const CertificateIdentity pinned_;
};

/// With a pinned authority the certificate chain is verified; with a pinned key the chain adds nothing. The host name
/// is not verified, because a probe's address can change.
std::shared_ptr<grpc::ChannelCredentials> pinned_credentials(const ProbeCredentials& credentials) {
  // An unreadable `pinned` matches no certificate.
  const Result<CertificateIdentity> pinned = identify_certificate(credentials.pinned);
  const bool by_authority = pinned.ok() && pinned->is_authority;
  std::vector<IdentityKeyCertPair> own;
  if (!credentials.client_certificate.empty()) own.push_back({credentials.client_key, credentials.client_certificate});
  TlsChannelCredentialsOptions options;
  if (by_authority || !own.empty())
    options.set_certificate_provider(
        std::make_shared<StaticDataCertificateProvider>(by_authority ? pinned->pem : std::string(), own));
  if (by_authority) options.watch_root_certs();
  if (!own.empty()) options.watch_identity_key_cert_pairs();
  options.set_verify_server_certs(by_authority);
  options.set_certificate_verifier(grpc::experimental::ExternalCertificateVerifier::Create<PinVerifier>(
      pinned.ok() ? *pinned : CertificateIdentity()));
  options.set_check_call_host(false);
  return grpc::experimental::TlsCredentials(options);
}

}  // namespace

std::shared_ptr<grpc::ChannelCredentials> plain_credentials() { return grpc::InsecureChannelCredentials(); }

std::shared_ptr<grpc::ChannelCredentials> tls_credentials(const ProbeCredentials& credentials) {
  std::shared_ptr<grpc::ChannelCredentials> channel =
      credentials.pinned.empty()
          ? grpc::SslCredentials({credentials.ca, credentials.client_key, credentials.client_certificate})
          : pinned_credentials(credentials);
  if (credentials.token.empty()) return channel;
  return grpc::CompositeChannelCredentials(channel, grpc::AccessTokenCredentials(credentials.token));
}

std::shared_ptr<grpc::ChannelCredentials> unverified_credentials() {
  TlsChannelCredentialsOptions options;
  options.set_verify_server_certs(false);
  options.set_certificate_verifier(std::make_shared<grpc::experimental::NoOpCertificateVerifier>());
  options.set_check_call_host(false);
  return grpc::experimental::TlsCredentials(options);
}

}  // namespace lightwell::core
