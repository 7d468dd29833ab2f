#include "core/grpc_credentials.hpp"

#include <string>
#include <vector>

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_certificate_verifier.h>
#include <grpcpp/security/tls_credentials_options.h>

namespace lightwell::core {
namespace {

using grpc::experimental::IdentityKeyCertPair;
using grpc::experimental::StaticDataCertificateProvider;
using grpc::experimental::TlsChannelCredentialsOptions;

/// By the pinned authority alone. OpenSSL checks the chain, the time and the use (serverAuth); that
/// the certificate names the host is not asked for, because a probe's address changes.
std::shared_ptr<grpc::ChannelCredentials> pinned_credentials(const ProbeCredentials& credentials) {
  std::vector<IdentityKeyCertPair> own;
  if (!credentials.client_certificate.empty()) own.push_back({credentials.client_key, credentials.client_certificate});
  TlsChannelCredentialsOptions options;
  options.set_certificate_provider(std::make_shared<StaticDataCertificateProvider>(credentials.pinned, own));
  options.watch_root_certs();
  if (!own.empty()) options.watch_identity_key_cert_pairs();
  options.set_certificate_verifier(std::make_shared<grpc::experimental::NoOpCertificateVerifier>());
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

std::shared_ptr<grpc::ChannelCredentials> stranger_credentials() {
  TlsChannelCredentialsOptions options;
  options.set_verify_server_certs(false);
  options.set_certificate_verifier(std::make_shared<grpc::experimental::NoOpCertificateVerifier>());
  options.set_check_call_host(false);
  return grpc::experimental::TlsCredentials(options);
}

}  // namespace lightwell::core
