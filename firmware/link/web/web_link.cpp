#include "link/web/web_link.hpp"

#include <optional>
#include <string>
#include <utility>

#include "link/access/link_access.hpp"
#include "link/access/listen_address.hpp"
#include "link/access/server_tls.hpp"
#include "link/web/web_server.hpp"

namespace lightwell {
namespace {

class WebLink final : public Link {
 public:
  WebLink(WebConfig config, GrpcConfig keys, std::string probe_name, Commands& commands,
          std::span<const StaticFile> files, WallClock clock)
      : config_(std::move(config)),
        key_config_(std::move(keys)),
        probe_name_(std::move(probe_name)),
        commands_(commands),
        files_(config_.dashboard == Dashboard::on ? files : std::span<const StaticFile>()),
        clock_(std::move(clock)) {}

  Status start() override {
    if (!is_host_and_port(config_.listen_address)) return listen_failure();
    if (const Status s = config_.check_bind_policy(); !s.ok()) return s;
    std::unique_ptr<ServerTls> tls;
    if (config_.encrypted())
      if (const Status s = open_access().assign_to(tls); !s.ok()) return s;
    server_ = std::make_unique<WebServer>(
        WebPages(files_, commands_), WebAuthorizer(config_.allowed_origins, access_ ? access_->authorizer : nullptr),
        std::move(tls), commands_);
    const std::optional<ListenTarget> target = resolve_listen_address(config_.listen_address);
    if (target && server_->open(*target)) return {};
    server_.reset();
    return listen_failure();
  }

  void publish(const EncodedDescriptor& descriptor) override { server_->publish(descriptor); }
  void publish_plane(const std::shared_ptr<const EncodedPlane>& plane) override { server_->publish_plane(plane); }
  void stop() override {
    if (server_) server_->stop();
  }

  LinkCounters counters() const override {
    LinkCounters c = server_ ? server_->counters() : LinkCounters();
    if (!access_) return c;
    c.authentication_failures = access_->authorizer->refused();
    c.client_list_faults = access_->clients->faults();
    return c;
  }
  std::string error_message() const override { return access_ ? access_->error_message() : std::string(); }
  std::string_view name() const override { return "web"; }
  std::string address() const override {
    return (config_.encrypted() ? "wss://" : "ws://") +
           config_.listen_address.substr(0, config_.listen_address.rfind(':')) + ":" +
           std::to_string(server_ ? server_->port() : 0);
  }

 private:
  [[nodiscard]] Status listen_failure() const {
    return listen_error(config_.listen_address, "web.listen_address or --web");
  }

  Result<std::unique_ptr<ServerTls>> open_access() {
    if (const Status s = LinkAccess::open(key_config_, probe_name_, clock_).assign_to(access_); !s.ok()) return s;
    return ServerTls::make(access_->keys, config_.security == LinkSecurity::mutual_tls ? ClientCertificates::required
                                                                                       : ClientCertificates::optional);
  }

  const WebConfig config_;
  const GrpcConfig key_config_;
  const std::string probe_name_;
  Commands& commands_;
  const std::span<const StaticFile> files_;
  const WallClock clock_;
  std::optional<LinkAccess> access_;  ///< With TLS.
  std::unique_ptr<WebServer> server_;
};

}  // namespace

std::unique_ptr<Link> make_web_link(const WebConfig& config, const GrpcConfig& keys, std::string_view probe_name,
                                    Commands& commands, std::span<const StaticFile> files, WallClock clock) {
  return std::make_unique<WebLink>(config, keys, std::string(probe_name), commands, files, std::move(clock));
}

}  // namespace lightwell
