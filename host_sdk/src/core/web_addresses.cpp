#include "core/web_addresses.hpp"

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include <lightwell/host_names.hpp>
#include <lightwell/text.hpp>

#include "core/discovery_backends.hpp"

namespace lightwell::core {
namespace {

/// What a thread inside the resolver shares with the one that waits, and may have left.
struct Lookup {
  std::mutex mutex;
  std::condition_variable changed;
  std::optional<std::vector<std::string>> addresses;
};

}  // namespace

HostAndPort split_host_port(const std::string& host_port) {
  const std::size_t colon = host_port.rfind(':');
  HostAndPort out{host_port.substr(0, colon),
                  parse_number<int>(std::string_view(host_port).substr(colon + 1)).value_or(0)};
  if (out.host.starts_with('[') && out.host.ends_with(']')) out.host = out.host.substr(1, out.host.size() - 2);
  return out;
}

Result<std::vector<std::string>> addresses_of(const std::string& host_port, const std::atomic<bool>& stopping) {
  const std::string host = split_host_port(host_port).host;
  if (std::vector<std::string> numeric = numeric_addresses(host, HostForm::numeric); !numeric.empty()) return numeric;
  if (is_mdns_name(host_port))
    if (const std::optional<std::string> found = mdns_address(host_port, &stopping))
      return std::vector<std::string>{split_host_port(*found).host};
  const auto lookup = std::make_shared<Lookup>();
  // The resolver cannot be interrupted.
  std::thread([lookup, host] {
    std::vector<std::string> found = numeric_addresses(host, HostForm::any);
    const std::lock_guard lock(lookup->mutex);
    lookup->addresses = std::move(found);
    lookup->changed.notify_all();
  }).detach();
  std::unique_lock lock(lookup->mutex);
  while (!lookup->addresses && !stopping) lookup->changed.wait_for(lock, std::chrono::milliseconds(100));
  if (lookup->addresses && !lookup->addresses->empty()) return *lookup->addresses;
  return Status(StatusCode::unavailable,
                "the name " + host + " cannot be resolved" +
                    (is_mdns_name(host_port)
                         ? "; names in .local are those of multicast DNS: is avahi-daemon running on this machine, and "
                           "the probe on?"
                         : ""));
}

}  // namespace lightwell::core
