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
class NetworkWatch {
 public:
  /// The links have been started.
  NetworkWatch(const Config& config, const StatusSnapshot& status, const Publisher& publisher);
  ~NetworkWatch();
  NetworkWatch(const NetworkWatch&) = delete;
  NetworkWatch& operator=(const NetworkWatch&) = delete;

  /// About once a second.
  void look();

 private:
  void tell(const std::string& what, const std::string& trouble, const std::string& good);

  const Publisher& publisher_;
  std::unique_ptr<Advertiser> advertiser_;
  std::map<std::string, std::string> told_;
  std::uint64_t told_refused_ = 0;
  std::int64_t told_refused_ns_ = 0;
};

}  // namespace lightwell
