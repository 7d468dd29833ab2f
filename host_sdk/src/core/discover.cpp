#include <algorithm>
#include <optional>
#include <thread>

#include <lightwell/advertisement.hpp>
#include <lightwell/discover.hpp>

#include "core/discovery_backends.hpp"

namespace lightwell {

Status DiscoverOptions::validate() const {
  if (timeout.ns <= 0 || timeout > Duration::from_seconds(3600))
    return {StatusCode::invalid_argument, "DiscoverOptions: timeout must be above zero, an hour at most"};
  if (!broker.empty()) {
    const Result<MqttAddress> address = parse_mqtt_address(broker, MqttBase::optional);
    if (!address.ok()) return address.status();
    if (Status status = check_plain_login(*address); !credentials.user.empty() && !status.ok()) return status;
  }
  return credentials.validate();
}

Discovered core::DiscoveryResults::take() {
  const std::lock_guard lock(mutex_);
  Discovered out;
  for (auto& [key, probe] : probes_) out.probes.push_back(std::move(probe));
  std::ranges::stable_sort(out.probes, {}, &FoundProbe::name);
  out.problems = std::move(problems_);
  out.refused = refused_;
  return out;
}

Result<Discovered> discover(const DiscoverOptions& options) {
  if (Status status = options.validate(); !status.ok()) return status;
  core::DiscoveryResults results;
  std::thread at_broker;
  if (!options.broker.empty()) {
#ifdef LIGHTWELL_HAVE_MQTT
    at_broker = std::thread([&] {
      core::discover_at_broker(*parse_mqtt_address(options.broker, MqttBase::optional), options.credentials,
                               options.timeout, results);
    });
#else
    results.problem("MQTT: this SDK was built without it; install libmosquitto-dev and build it again");
#endif
  }
  std::thread by_usb([&] { core::discover_by_usb(options.timeout, results); });
#ifdef LIGHTWELL_HAVE_MDNS
  core::discover_by_mdns(options.timeout, results);
#else
  results.problem("mDNS: this SDK was built without Avahi; install libavahi-client-dev and build it again");
#endif
  if (at_broker.joinable()) at_broker.join();
  by_usb.join();
  return results.take();
}

}  // namespace lightwell
