#include "watch_statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "json_line.hpp"

namespace lightwell::tool {

double percentile(std::vector<double>& values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double rank = std::ceil(p / 100 * static_cast<double>(values.size()));
  const auto index = static_cast<std::size_t>(std::max(rank, 1.0)) - 1;
  return values[std::min(index, values.size() - 1)];
}

std::vector<std::string_view> flag_names(Flags flags) {
  std::vector<std::string_view> names;
  for (const Flag flag : kFlags)
    if (flags.has(flag)) names.push_back(to_string(flag));
  return names;
}

std::string flags_text(Flags flags) {
  std::string text;
  for (const std::string_view name : flag_names(flags)) text += (text.empty() ? "" : " ") + std::string(name);
  return text.empty() ? "-" : text;
}

std::string bound_text(float bound) {
  if (!std::isfinite(bound)) return "infinite";
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2f %%", 100 * static_cast<double>(bound));
  return text.data();
}

void WatchStatistics::add(const ReceivedDescriptor& item) {
  const Duration delivered = item.descriptor.time.delivered_after;
  latency_ms_.push_back((item.stored - (item.mid_exposure + delivered)).milliseconds());
  age_ms_.push_back((item.stored - item.mid_exposure).milliseconds());
  bytes_.push_back(static_cast<double>(item.bytes.size()));
  newest_ = item.descriptor;
}

std::string WatchStatistics::json(std::string_view kind, double seconds, const LinkStats& stats,
                                  const ProbeInfo& info) {
  const auto count = static_cast<double>(latency_ms_.size());
  JsonLine line;
  line.text("kind", kind)
      .number("seconds", seconds)
      .number("frames", count)
      .number("frames_per_s", seconds > 0 ? count / seconds : 0)
      .number("latency_p50_ms", percentile(latency_ms_, 50))
      .number("latency_p99_ms", percentile(latency_ms_, 99))
      .number("age_p50_ms", percentile(age_ms_, 50))
      .number("age_p99_ms", percentile(age_ms_, 99))
      .number("bytes_p50", percentile(bytes_, 50))
      .number("bytes_max", percentile(bytes_, 100))
      .number("lights", static_cast<double>(newest_.lights.size()))
      .number("band", newest_.radiance.band)
      .number("bound", static_cast<double>(newest_.bound.total))
      .texts("flags", flag_names(newest_.flags))
      .number("sequence", static_cast<double>(newest_.sequence))
      .number("gaps", static_cast<double>(stats.gaps))
      .number("rejected", static_cast<double>(stats.oversized + stats.undecodable + stats.replayed +
                                              stats.frames_refused + stats.untimely))
      .number("reconnects", static_cast<double>(stats.reconnects))
      .number("clock_uncertainty_ms", info.clock_uncertainty.milliseconds())
      .text("state", to_string(stats.state));
  return line.str();
}

std::string WatchStatistics::text(double seconds, const LinkStats& stats, const ProbeInfo& info) {
  const auto count = static_cast<double>(latency_ms_.size());
  if (latency_ms_.empty()) {
    std::string text = "no descriptor; the link is " + std::string(to_string(stats.state));
    return stats.last_error.empty() ? text : text + " (" + stats.last_error + ")";
  }
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(),
                "%5.1f/s  latency %.2f / %.2f ms  age %.1f / %.1f ms  clock +-%.2f ms  %.0f B  "
                "lights %zu  band %d  bound %s  flags %s  gaps %llu",
                count / seconds, percentile(latency_ms_, 50), percentile(latency_ms_, 99), percentile(age_ms_, 50),
                percentile(age_ms_, 99), info.clock_uncertainty.milliseconds(), percentile(bytes_, 50),
                newest_.lights.size(), newest_.radiance.band, bound_text(newest_.bound.total).c_str(),
                flags_text(newest_.flags).c_str(), static_cast<unsigned long long>(stats.gaps));
  return text.data();
}

}  // namespace lightwell::tool
