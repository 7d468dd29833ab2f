// The links and the announcement that a configuration asks for, and what is told of them while they run.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>

#include "link/publisher.hpp"

namespace lightwell {

class Advertiser;

/// Adds the MQTT link to `publisher` where `config` has one. failed_precondition where it, or the announcement, is
/// asked for and was not built.
[[nodiscard]] Status add_network_links(const Config& config, Commands& commands, Publisher& publisher);

/// Announces the probe where that is configured, and logs when links or the announcement get into trouble and out of
/// it.
class NetworkMonitor {
 public:
  /// The links have been started.
  NetworkMonitor(const Config& config, const StatusSnapshot& status, const Publisher& publisher);
  ~NetworkMonitor();
  NetworkMonitor(const NetworkMonitor&) = delete;
  NetworkMonitor& operator=(const NetworkMonitor&) = delete;

  /// About once a second.
  void poll();

 private:
  void log_transition(const std::string& what, const std::string& error_message, const std::string& good);

  const Publisher& publisher_;
  std::unique_ptr<Advertiser> advertiser_;
  std::map<std::string, std::string> last_logged_;
  std::uint64_t logged_refused_ = 0;
  std::int64_t logged_refused_ns_ = 0;
};

}  // namespace lightwell
