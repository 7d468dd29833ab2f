#include "link/grpc/grpc_link.hpp"

#include <string>

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>

#include "link/access/client_list.hpp"
#include "link/access/probe_keys.hpp"
#include "link/grpc/probe_service.hpp"
#include "link/grpc/transport.hpp"

namespace lightwell {
namespace {

class GrpcLink final : public Link {
 public:
  GrpcLink(GrpcConfig config, std::string probe_name, Commands& commands, WallClock clock)
      : config_(std::move(config)), probe_name_(std::move(probe_name)), clock_(std::move(clock)), service_(commands) {}
  ~GrpcLink() override { stop(); }

  Status start() override {
    if (!is_host_and_port(config_.listen_address)) return listen_failure();
    if (const Status s = config_.check_bind_policy(); !s.ok()) return s;
    std::shared_ptr<grpc::ServerCredentials> credentials = grpc::InsecureServerCredentials();
    if (config_.encrypted())
      if (const Status s = make_tls_credentials().assign_to(credentials); !s.ok()) return s;
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort(config_.listen_address, credentials, &port);
    service_.register_at(builder);
    set_limits(builder);
    server_ = builder.BuildAndStart();
    if (!server_ || port == 0) {
      server_.reset();
      return listen_failure();
    }
    port_ = port;
    server_->GetHealthCheckService()->SetServingStatus("lightwell.v1.ProbeService", true);
    return {};
  }

  void publish(const EncodedDescriptor& descriptor) override { service_.publish(descriptor); }

  void stop() override {
    if (!server_) return;
    service_.close_streams();
    server_->Shutdown(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
    server_->Wait();
    server_.reset();
  }

  LinkCounters counters() const override {
    LinkCounters c = service_.counters();
    if (authorizer_) c.authentication_failures = authorizer_->refused();
    if (clients_) c.client_list_faults = clients_->faults();
    return c;
  }

  std::string error_message() const override {
    if (!keys_) return {};
    const std::string keys = keys_->error_message(), clients = clients_->error_message();
    return keys + (keys.empty() || clients.empty() ? "" : "; ") + clients;
  }

  std::string address() const override {
    return (config_.encrypted() ? "grpcs://" : "grpc://") +
           config_.listen_address.substr(0, config_.listen_address.rfind(':')) + ":" + std::to_string(port_);
  }

 private:
  [[nodiscard]] Status listen_failure() const {
    return listen_error(config_.listen_address, "grpc.listen_address or --listen");
  }

  Result<std::shared_ptr<grpc::ServerCredentials>> make_tls_credentials() {
    keys_ = std::make_shared<ReloadingKeys>(config_, probe_name_, clock_);
    const Result<ProbeKeys> keys = keys_->load();
    if (!keys) return keys.status();
    clients_ = std::make_shared<ClientList>(keys->client_list);
    if (const Status s = clients_->load(); !s.ok()) return s;
    const bool required = config_.security == LinkSecurity::mutual_tls;
    authorizer_ = std::make_shared<CallAuthorizer>(
        clients_, keys->issues_client_certificates() ? CertificatePolicy::listed : CertificatePolicy::any);
    return reloading_tls_credentials(keys_, required ? ClientCertificates::required : ClientCertificates::optional,
                                     authorizer_);
  }

  const GrpcConfig config_;
  const std::string probe_name_;
  const WallClock clock_;
  ProbeService service_;
  std::shared_ptr<ReloadingKeys> keys_;
  std::shared_ptr<ClientList> clients_;
  std::shared_ptr<CallAuthorizer> authorizer_;
  std::unique_ptr<grpc::Server> server_;
  int port_ = 0;
};

}  // namespace

std::unique_ptr<Link> make_grpc_link(const GrpcConfig& config, std::string_view probe_name, Commands& commands,
                                     WallClock clock) {
  return std::make_unique<GrpcLink>(config, std::string(probe_name), commands, std::move(clock));
}

}  // namespace lightwell
