// The backends of discover(), and the collection of their results; host names in .local.
#pragma once

#include <atomic>
#include <cstddef>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include <lightwell/discover.hpp>
#include <lightwell/mqtt.hpp>

namespace lightwell::core {

/// Collects results; any thread.
class DiscoveryResults {
 public:
  static constexpr std::size_t kMaxProbes = 1'000;

  /// Adds a probe, or replaces the one with the same key. A new probe above kMaxProbes is only counted as refused.
  void put(const std::string& key, FoundProbe probe) {
    const std::lock_guard lock(mutex_);
    if (probes_.size() >= kMaxProbes && !probes_.contains(key))
      ++refused_;
    else
      probes_[key] = std::move(probe);
  }
  void remove(const std::string& key) {
    const std::lock_guard lock(mutex_);
    probes_.erase(key);
  }
  void refuse() {
    const std::lock_guard lock(mutex_);
    ++refused_;
  }
  void problem(const std::string& what) {
    const std::lock_guard lock(mutex_);
    problems_.push_back(what);
  }
  [[nodiscard]] Discovered take();

 private:
  std::mutex mutex_;
  std::map<std::string, FoundProbe> probes_;
  std::vector<std::string> problems_;
  std::size_t refused_ = 0;
};

// Each blocks for at most `timeout`, or reports a problem at once, for example that the SDK was built without it.

void discover_by_mdns(Duration timeout, DiscoveryResults& results);
void discover_at_broker(const MqttAddress& broker, const MqttCredentials& credentials, Duration timeout,
                        DiscoveryResults& results);

// Host names in .local by multicast DNS (RFC 6762), which gRPC's resolver does not support.

/// Whether the host of "host:port" is a name in .local.
[[nodiscard]] bool is_mdns_name(const std::string& host_port);

/// "host:port" with the host's current address, IPv4 if it has both; resolve again for each connection. No value if
/// there is no answer within a second, if multicast DNS is not available (no avahi-daemon, built without Avahi), or
/// once `*stopping` is set (may be null).
[[nodiscard]] std::optional<std::string> mdns_address(const std::string& host_port, const std::atomic<bool>* stopping);

}  // namespace lightwell::core
