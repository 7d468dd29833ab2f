// Statistics of `lightwell watch`.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/probe.hpp>

#include "feed.hpp"

namespace lightwell::tool {

/// Statistics of the descriptors of a time interval. Percentiles are nearest-rank (lower_quantile()).
class WatchStatistics {
 public:
  void add(const ReceivedDescriptor& item);
  [[nodiscard]] bool empty() const { return latency_ms_.empty(); }

  /// `kind` is "second" or "summary"; `stats` are since the start, `seconds` is the length of the interval. The keys
  /// are documented in `lightwell watch --help`.
  [[nodiscard]] std::string json(std::string_view kind, double seconds, const LinkStats& stats, const ProbeInfo& info);
  [[nodiscard]] std::string text(double seconds, const LinkStats& stats, const ProbeInfo& info);

 private:
  std::vector<double> latency_ms_, age_ms_, bytes_;
  Descriptor newest_;
};

/// "unseen clipped", or "-" for none.
[[nodiscard]] std::string flags_text(Flags flags);
[[nodiscard]] std::vector<std::string_view> flag_names(Flags flags);
/// "1.2 %", or "infinite".
[[nodiscard]] std::string bound_text(float bound);

}  // namespace lightwell::tool
