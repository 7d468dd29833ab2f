#include "link/grpc/transport.hpp"

namespace lightwell {

std::shared_ptr<grpc::ServerCredentials> tls_credentials(const ProbeKeys& keys, ClientCertificates clients) {
  grpc::SslServerCredentialsOptions options;
  options.pem_key_cert_pairs.push_back({keys.key, keys.certificate});
  switch (clients) {
    case ClientCertificates::not_asked:
      options.client_certificate_request = GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE;
      break;
    case ClientCertificates::welcome:
      options.client_certificate_request = GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY;
      break;
    case ClientCertificates::required:
      options.client_certificate_request = GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY;
      break;
  }
  if (clients != ClientCertificates::not_asked) options.pem_root_certs = keys.client_ca;
  return grpc::SslServerCredentials(options);
}

void set_limits(grpc::ServerBuilder& builder) {
  // Two daemons on one port would share its clients at random.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  // A client that vanished without a word is noticed and its stream ended.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 5'000);
  // Also one that asks nothing yet, as an attempt that its maker gave up while the network was down: else its handle
  // stays.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  // One that pings more often than every five seconds is sent away (too_many_pings) at the third.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5'000);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PING_STRIKES, 2);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 32);
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, 8 * 1024);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 5'000);
  builder.SetMaxReceiveMessageSize(kMaxWireMessageBytes);
}

Status cannot_listen(const std::string& listen, const std::string& options) {
  return {StatusCode::resource_exhausted,
          "cannot listen on '" + listen +
              "': the address is malformed (HOST:PORT), not of this machine, or its port is in use by another "
              "program (find it with `ss -ltnp`); choose another with " +
              options + ", port 0 takes any"};
}

}  // namespace lightwell
