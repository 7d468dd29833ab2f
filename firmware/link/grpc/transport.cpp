#include "link/grpc/transport.hpp"

#include <optional>

#include <grpc/grpc.h>
#include <grpc/grpc_security.h>

namespace lightwell {
namespace {

constexpr std::string_view kHealth = "/grpc.health.v1.Health/";
/// gRPC refuses larger messages without reading them. The services have smaller limits and count what they refuse.
constexpr int kMaxWireMessageBytes = 64 * 1024;

std::string_view view_of(const grpc_slice& slice) {
  return {reinterpret_cast<const char*>(GRPC_SLICE_START_PTR(slice)), GRPC_SLICE_LENGTH(slice)};
}

/// Uses gRPC's C interface, because only that fetches the certificates at each handshake. The C++ interface reads them
/// once, or from files, of which it also accepts a key and a certificate that do not belong together.
class ReloadingTlsCredentials final : public grpc::ServerCredentials {
 public:
  ReloadingTlsCredentials(std::shared_ptr<ReloadingKeys> keys, ClientCertificates clients,
                          std::shared_ptr<CallAuthorizer> authorizer) {
    // gRPC keeps the C object as long as a server uses it, and then deletes `parts` by the callback.
    auto* const parts = new Parts{std::move(keys), std::move(authorizer)};
    const grpc_ssl_client_certificate_request_type request =
        clients == ClientCertificates::required ? GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY
                                                : GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY;
    held_ = grpc_ssl_server_credentials_create_with_options(
        grpc_ssl_server_credentials_create_options_using_config_fetcher(request, fetch, parts));
    grpc_server_credentials_set_auth_metadata_processor(
        held_, {process, [](void* state) { delete static_cast<Parts*>(state); }, parts});
  }
  ReloadingTlsCredentials(const ReloadingTlsCredentials&) = delete;
  ReloadingTlsCredentials& operator=(const ReloadingTlsCredentials&) = delete;
  ~ReloadingTlsCredentials() override { grpc_server_credentials_release(held_); }

  /// Ignored: the constructor sets the authorizer.
  void SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>&) override {}

 private:
  struct Parts {
    std::shared_ptr<ReloadingKeys> keys;
    std::shared_ptr<CallAuthorizer> authorizer;
  };

  int AddPortToServer(const std::string& address, grpc_server* server) override {
    return grpc_server_add_http2_port(server, address.c_str(), held_);
  }

  static grpc_ssl_certificate_config_reload_status fetch(void* state, grpc_ssl_server_certificate_config** config) {
    const std::optional<ProbeKeys> keys = static_cast<Parts*>(state)->keys->take_changed();
    if (!keys) return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
    const grpc_ssl_pem_key_cert_pair own{keys->key.c_str(), keys->certificate.c_str()};
    *config = grpc_ssl_server_certificate_config_create(keys->client_ca.c_str(), &own, 1);
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
  }

  static void process(void* state, grpc_auth_context* context, const grpc_metadata* metadata, std::size_t count,
                      grpc_process_auth_metadata_done_cb done, void* user_data) {
    std::string_view path;
    CallCredentials call;
    for (std::size_t i = 0; i < count; ++i) {
      const std::string_view name = view_of(metadata[i].key), value = view_of(metadata[i].value);
      if (name == ":path") path = value;
      // The first of several headers is used.
      if (name == "authorization" && call.authorization.empty()) call.authorization = value;
    }
    grpc_auth_property_iterator properties =
        grpc_auth_context_find_properties_by_name(context, GRPC_X509_PEM_CERT_PROPERTY_NAME);
    if (const grpc_auth_property* const shown = grpc_auth_property_iterator_next(&properties))
      call.certificate = {shown->value, shown->value_length};
    // The health service is for everyone.
    const char* const denial_reason =
        path.starts_with(kHealth) ? nullptr : static_cast<Parts*>(state)->authorizer->denial_reason(call);
    done(user_data, nullptr, 0, nullptr, 0, denial_reason == nullptr ? GRPC_STATUS_OK : GRPC_STATUS_UNAUTHENTICATED,
         denial_reason);
  }

  grpc_server_credentials* held_ = nullptr;
};

}  // namespace

std::shared_ptr<grpc::ServerCredentials> tls_credentials(const ProbeKeys& keys) {
  grpc::SslServerCredentialsOptions options(GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
  options.pem_key_cert_pairs.push_back({keys.key, keys.certificate});
  return grpc::SslServerCredentials(options);
}

std::shared_ptr<grpc::ServerCredentials> reloading_tls_credentials(std::shared_ptr<ReloadingKeys> keys,
                                                                   ClientCertificates clients,
                                                                   std::shared_ptr<CallAuthorizer> authorizer) {
  return std::make_shared<ReloadingTlsCredentials>(std::move(keys), clients, std::move(authorizer));
}

void set_limits(grpc::ServerBuilder& builder) {
  // With SO_REUSEPORT, two daemons on one port would share its clients at random.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  // Keep-alive pings detect clients that vanished and end their streams.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 5'000);
  // Also connections without calls, for example an attempt abandoned while the network was down; otherwise the file
  // descriptor stays open.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  // A client that pings more often than every five seconds is disconnected (too_many_pings) at the third such ping.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5'000);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PING_STRIKES, 2);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 32);
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, 8 * 1024);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 5'000);
  builder.SetMaxReceiveMessageSize(kMaxWireMessageBytes);
}

grpc::Status rpc_status(const Status& s) {
  // In the order of StatusCode.
  constexpr grpc::StatusCode kCodes[] = {grpc::StatusCode::OK,
                                         grpc::StatusCode::INVALID_ARGUMENT,
                                         grpc::StatusCode::NOT_FOUND,
                                         grpc::StatusCode::DATA_LOSS,
                                         grpc::StatusCode::FAILED_PRECONDITION,
                                         grpc::StatusCode::UNAVAILABLE,
                                         grpc::StatusCode::RESOURCE_EXHAUSTED,
                                         grpc::StatusCode::INTERNAL};
  return {kCodes[static_cast<std::size_t>(s.code())], s.message()};
}

}  // namespace lightwell
