#include "core/grpc_channel.hpp"

#include <algorithm>
#include <cstring>
#include <functional>
#include <iterator>
#include <optional>
#include <utility>

#include <grpcpp/create_channel.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_certificate_verifier.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <grpcpp/support/channel_arguments.h>
#include <grpcpp/support/slice.h>

#include <lightwell/secrets.hpp>
#include <lightwell/text.hpp>

#include "core/discovery_backends.hpp"

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

constexpr std::pair<grpc::StatusCode, StatusCode> kCodes[] = {
    {grpc::StatusCode::INVALID_ARGUMENT, StatusCode::invalid_argument},
    {grpc::StatusCode::OUT_OF_RANGE, StatusCode::invalid_argument},
    {grpc::StatusCode::UNIMPLEMENTED, StatusCode::invalid_argument},
    {grpc::StatusCode::NOT_FOUND, StatusCode::not_found},
    {grpc::StatusCode::DATA_LOSS, StatusCode::data_loss},
    {grpc::StatusCode::FAILED_PRECONDITION, StatusCode::failed_precondition},
    {grpc::StatusCode::UNAUTHENTICATED, StatusCode::failed_precondition},
    {grpc::StatusCode::UNAVAILABLE, StatusCode::unavailable},
    {grpc::StatusCode::CANCELLED, StatusCode::unavailable},
    {grpc::StatusCode::DEADLINE_EXCEEDED, StatusCode::unavailable},
    {grpc::StatusCode::RESOURCE_EXHAUSTED, StatusCode::resource_exhausted},
};

/// gRPC's error message of a failed connection, with an explanation and a remedy.
std::string explained(const std::string& message) {
  const auto says = [&](std::string_view part) { return message.find(part) != std::string::npos; };
  // The messages of OpenSSL, and of gRPC if the SDK's certificate verifier rejects.
  if (says("certificate verify failed") || says("verification check failed"))
    return "the TLS handshake failed: the certificate at this address has expired, was not issued by the trusted "
           "authority, or is not the pinned one; if the probe was given new keys, pair with it again (" +
           message + ")";
  if (says("DNS resolution failed") && says(".local"))
    return message +
           "; names in .local are those of multicast DNS: is avahi-daemon running on this machine, and the probe on?";
  if (says("andshake failed")) return "the TLS handshake failed (" + message + ")";
  return message;
}

}  // namespace

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

gpr_timespec deadline_after(Duration from_now) {
  return gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC), gpr_time_from_nanos(from_now.ns, GPR_TIMESPAN));
}

std::shared_ptr<grpc::Channel> new_channel(const std::string& host_port,
                                           const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                                           const std::atomic<bool>* stopping) {
  std::string target = host_port;
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // A probe is on the local network, so the proxy of the environment variables is not used.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // The reader thread controls reconnection.
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  // Limit flow control to about 20 descriptors; the probe then drops old ones. By default gRPC would let the probe send
  // up to 16 MiB ahead of a slow reader: half an hour of old descriptors at 30 per second.
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 4096);
  if (is_mdns_name(host_port))
    if (const std::optional<std::string> address = mdns_address(host_port, stopping)) {
      target = *address;
      arguments.SetSslTargetNameOverride(host_port.substr(0, host_port.rfind(':')));
    }
  return grpc::CreateCustomChannel("dns:///" + target, credentials, arguments);
}

Status status_of(const grpc::Status& status) {
  if (status.ok()) return {};
  const auto* const known =
      std::ranges::find(kCodes, status.error_code(), &std::pair<grpc::StatusCode, StatusCode>::first);
  return {known == std::end(kCodes) ? StatusCode::internal : known->second,
          explained(printable(status.error_message()))};
}

std::span<const std::byte> bytes_of(const grpc::ByteBuffer& buffer, std::vector<std::byte>& storage) {
  storage.clear();
  std::vector<grpc::Slice> slices;
  if (!buffer.Dump(&slices).ok()) return {};
  for (const grpc::Slice& slice : slices) {
    const std::size_t end = storage.size();
    storage.resize(end + slice.size());
    if (slice.size() > 0) std::memcpy(storage.data() + end, slice.begin(), slice.size());
  }
  return storage;
}

}  // namespace lightwell::core
