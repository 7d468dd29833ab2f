// What `lightwell watch` measures.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/probe.hpp>

#include "feed.hpp"

namespace lightwell::tool {

/// The nearest-rank percentile, p in (0, 100]; NaN of nothing. Sorts.
[[nodiscard]] double percentile(std::vector<double>& values, double p);

/// Descriptors of a stretch of time, summed up.
class WatchStatistics {
 public:
  void add(const ReceivedDescriptor& item);
  [[nodiscard]] bool empty() const { return latency_ms_.empty(); }

  /// `kind` is "second" or "summary"; stats are since the start, `seconds` is how long it took. The
  /// keys are those that `lightwell watch --help` tells.
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
