#include <algorithm>
#include <thread>

#include <lightwell/discover.hpp>

#include "core/discovery_backends.hpp"
#include "core/usb_transport.hpp"

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

namespace {

/// Requests Info from a probe on USB.
void request_info(const std::string& serial, Duration timeout, core::DiscoveryResults& results) {
  const std::string uri = "usb:" + serial;
  FoundProbe found;
  found.by = FoundBy::usb;
  found.instance = serial;
  found.links = {{uri, "none"}};
  ProbeOptions options;
  options.connect_timeout = timeout;
  if (const Result<Probe> probe = Probe::connect(uri, options); probe.ok()) {
    const ProbeInfo info = probe->info();
    found.name = info.name;
    found.id = info.id;
    found.calibration_id = info.calibration_id;
    found.version = info.version;
  } else {
    // The probe is listed nevertheless: another program may have opened it.
    results.problem(probe.status().message());
  }
  results.put(uri, std::move(found));
}

/// Requests Info from all probes on USB concurrently.
void discover_by_usb(Duration timeout, core::DiscoveryResults& results) {
  const Result<std::vector<std::string>> serials = core::probes_on_usb();
  if (!serials.ok()) return results.problem("USB: " + serials.status().message());
  std::vector<std::thread> threads;
  for (const std::string& serial : *serials)
    threads.emplace_back([&results, &serial, timeout] { request_info(serial, timeout, results); });
  for (std::thread& t : threads) t.join();
}

}  // namespace

Result<Discovered> discover(const DiscoverOptions& options) {
  if (Status status = options.validate(); !status.ok()) return status;
  core::DiscoveryResults results;
  std::vector<std::thread> threads;
  if (!options.broker.empty())
    threads.emplace_back([&] {
      core::discover_at_broker(*parse_mqtt_address(options.broker, MqttBase::optional), options.credentials,
                               options.timeout, results);
    });
  threads.emplace_back([&] { discover_by_usb(options.timeout, results); });
  core::discover_by_mdns(options.timeout, results);
  for (std::thread& t : threads) t.join();
  return results.take();
}

}  // namespace lightwell
