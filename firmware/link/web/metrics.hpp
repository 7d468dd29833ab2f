// The probe's counters in Prometheus' text format.
#pragma once

#include <string>

#include <lightwell/status.hpp>

namespace lightwell {

inline constexpr const char* kMetricsContentType = "text/plain; version=0.0.4; charset=utf-8";

/// Text-based exposition format 0.0.4 (prometheus.io/docs/instrumenting/exposition_formats): one family for each of
/// Counters, and lightwell_info with the probe's texts as labels.
[[nodiscard]] std::string metrics_text(const StatusSnapshot& status);

}  // namespace lightwell
