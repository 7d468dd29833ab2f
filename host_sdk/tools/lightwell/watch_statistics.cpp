#include "watch_statistics.hpp"

#include <cmath>

#include <nlohmann/json.hpp>

#include <lightwell/quantile.hpp>
#include <lightwell/text.hpp>

#include "json_text.hpp"

namespace lightwell::tool {

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
  return formatted("%.2f %%", 100 * static_cast<double>(bound));
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
  const std::size_t count = latency_ms_.size();
  const auto whole = [](double n) {
    return std::isfinite(n) ? nlohmann::ordered_json(std::llround(n)) : nlohmann::ordered_json();
  };
  const nlohmann::ordered_json out = {
      {"kind", kind},
      {"seconds", seconds},
      {"frames", count},
      {"frames_per_s", seconds > 0 ? static_cast<double>(count) / seconds : 0},
      {"latency_p50_ms", lower_quantile(latency_ms_, 0.5)},
      {"latency_p99_ms", lower_quantile(latency_ms_, 0.99)},
      {"age_p50_ms", lower_quantile(age_ms_, 0.5)},
      {"age_p99_ms", lower_quantile(age_ms_, 0.99)},
      {"bytes_p50", whole(lower_quantile(bytes_, 0.5))},
      {"bytes_max", whole(lower_quantile(bytes_, 1))},
      {"lights", newest_.lights.size()},
      {"band", newest_.radiance.band},
      {"bound", newest_.bound.total},
      {"flags", flag_names(newest_.flags)},
      {"sequence", newest_.sequence},
      {"gaps", stats.gaps},
      {"rejected", stats.oversized + stats.undecodable + stats.replayed + stats.frames_refused + stats.untimely},
      {"reconnects", stats.reconnects},
      {"clock_uncertainty_ms", info.clock_uncertainty.milliseconds()},
      {"state", to_string(stats.state)}};
  return json_text(out);
}

std::string WatchStatistics::text(double seconds, const LinkStats& stats, const ProbeInfo& info) {
  const auto count = static_cast<double>(latency_ms_.size());
  if (latency_ms_.empty()) {
    std::string text = "no descriptor; the link is " + std::string(to_string(stats.state));
    return stats.last_error.empty() ? text : text + " (" + stats.last_error + ")";
  }
  return formatted(
      "%5.1f/s  latency %.2f / %.2f ms  age %.1f / %.1f ms  clock +-%.2f ms  %.0f B  "
      "lights %zu  band %d  bound %s  flags %s  gaps %llu",
      count / seconds, lower_quantile(latency_ms_, 0.5), lower_quantile(latency_ms_, 0.99),
      lower_quantile(age_ms_, 0.5), lower_quantile(age_ms_, 0.99), info.clock_uncertainty.milliseconds(),
      lower_quantile(bytes_, 0.5), newest_.lights.size(), newest_.radiance.band,
      bound_text(newest_.bound.total).c_str(), flags_text(newest_.flags).c_str(),
      static_cast<unsigned long long>(stats.gaps));
}

}  // namespace lightwell::tool
