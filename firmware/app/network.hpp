// The links and the mDNS announcement of a configuration, and the log of their state.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include <lightwell/commands.hpp>
#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "link/publisher.hpp"

namespace lightwell {

class Advertiser;

/// Adds the links of `config` to `publisher`. failed_precondition: a link or the announcement is configured, but not in
/// this build.
[[nodiscard]] Status add_links(const Config& config, Commands& commands, Publisher& publisher);

/// Announces the probe if that is configured, and logs when a link or the announcement fails or recovers.
class NetworkMonitor {
 public:
  /// Call it after the links have been started.
  NetworkMonitor(const Config& config, const StatusSnapshot& status, const Publisher& publisher);
  ~NetworkMonitor();
  NetworkMonitor(const NetworkMonitor&) = delete;
  NetworkMonitor& operator=(const NetworkMonitor&) = delete;

  /// Logs changes; call it about once a second.
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
