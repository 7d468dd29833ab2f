// Discovery of probes by their status, which is retained at an MQTT broker.
#include <string>

#include <lightwell/status.hpp>

#include "core/discovery_backends.hpp"
#include "core/mqtt_login.hpp"

namespace lightwell::core {
namespace {

constexpr std::string_view kStatus = "/status";

/// Topic levels below the base that are searched; more would match topics of other applications.
std::vector<std::string> status_topics(const std::string& base) {
  std::vector<std::string> out;
  if (!base.empty()) out.push_back(base + std::string(kStatus));
  std::string level = base.empty() ? "+" : base + "/+";
  for (int i = 0; i < 3; ++i, level += "/+") out.push_back(level + std::string(kStatus));
  return out;
}

class Listener {
 public:
  Listener(const MqttAddress& broker, const MqttCredentials& credentials, Duration timeout, DiscoveryResults& results)
      : broker_(broker), results_(results), session_(options(credentials, timeout)) {}

  void run(Duration timeout) {
    const HostTime end = HostTime{monotonic_now_ns()} + timeout;
    for (;;) {
      const Duration left = end - HostTime{monotonic_now_ns()};
      if (left.ns <= 0) break;
      session_.run_once(left);
    }
    if (!failure_.empty()) results_.problem(broker_.uri() + ": " + failure_);
  }

 private:
  MqttSession::Options options(const MqttCredentials& credentials, Duration timeout) {
    MqttSession::Options out;
    out.address = broker_;
    out.login = login_of(credentials);
    out.subscriptions = status_topics(broker_.base);
    out.retry_min = {200'000'000};
    out.retry_max = {1'000'000'000};
    out.connect_timeout = timeout;
    out.on_connected = [this] { failure_.clear(); };
    out.on_lost = [this](const std::string& why) { failure_ = why; };
    out.on_message = [this](const MqttMessage& message) { on_status(message); };
    return out;
  }

  void on_status(const MqttMessage& message) {
    MqttAddress own = broker_;
    own.base = message.topic.substr(0, message.topic.size() - kStatus.size());
    // Any client may publish on any topic: a topic that is not a valid base is ignored.
    const Result<MqttAddress> address = parse_mqtt_address(own.uri());
    if (!address.ok() || address->base != own.base) return results_.refuse();
    FoundProbe probe;
    probe.by = FoundBy::mqtt;
    probe.instance = own.base;
    probe.links = {{own.uri(), own.transport == MqttTransport::tls ? "tls" : "none"}};
    if (std::string_view(reinterpret_cast<const char*>(message.payload.data()), message.payload.size()) == kMqttGone) {
      probe.gone = true;
    } else {
      const Result<StatusSnapshot> status = message.payload.size() <= kMaxMqttStatusBytes
                                                ? decode_status(message.payload)
                                                : Status(StatusCode::data_loss, "too long");
      if (!status.ok()) return results_.refuse();
      probe.name = status->probe_name;
      probe.id = status->probe_id;
      probe.calibration_id = status->calibration_id;
      probe.version = status->version;
    }
    results_.put("mqtt " + own.base, std::move(probe));
  }

  const MqttAddress broker_;
  DiscoveryResults& results_;
  std::string failure_ = "the broker does not respond";
  MqttSession session_;  // last, because its callbacks use the members above
};

}  // namespace

void discover_at_broker(const MqttAddress& broker, const MqttCredentials& credentials, Duration timeout,
                        DiscoveryResults& results) {
  Listener(broker, credentials, timeout, results).run(timeout);
}

}  // namespace lightwell::core
