// Discovery of probes on USB: requests Info from each.
#include <string>
#include <thread>
#include <vector>

#include <lightwell/probe.hpp>

#include "core/discovery_backends.hpp"
#include "core/usb_transport.hpp"

namespace lightwell::core {
namespace {

void request_info(const std::string& serial, Duration timeout, DiscoveryResults& results) {
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

}  // namespace

void discover_by_usb(Duration timeout, DiscoveryResults& results) {
  const Result<std::vector<std::string>> serials = probes_on_usb();
  if (!serials.ok()) return results.problem("USB: " + serials.status().message());
  std::vector<std::thread> threads;
  for (const std::string& serial : *serials)
    threads.emplace_back([&results, &serial, timeout] { request_info(serial, timeout, results); });
  for (std::thread& t : threads) t.join();
}

}  // namespace lightwell::core
