// C ABI of a probe's recording and calibration.
#include <algorithm>
#include <cstddef>
#include <cstring>
#include <optional>
#include <string_view>

#include <lightwell/probe.hpp>
#include <lightwell/probe_status.h>

#include "c/call.hpp"

namespace lightwell::c {
namespace {

/// `to` is zero.
template <std::size_t capacity>
void put_text(std::string_view from, char (&to)[capacity]) {
  std::memcpy(to, from.data(), whole_characters(from, capacity - 1));
}

lw_recording as_c(const std::optional<RecordingStatus>& status) {
  lw_recording out{};
  out.size = sizeof out;
  if (!status) return out;
  out.available = 1;
  out.running = status->running ? 1 : 0;
  out.bytes = status->bytes;
  out.descriptors = status->descriptors;
  out.lost = status->lost;
  out.faults = status->faults;
  put_text(status->file, out.file);
  put_text(status->end_reason, out.end_reason);
  return out;
}

lw_calibration as_c(const CalibrationSummary& summary) {
  lw_calibration out{};
  out.size = sizeof out;
  out.id = summary.id;
  out.absolute = summary.absolute ? 1 : 0;
  out.lens_count = static_cast<std::uint32_t>(summary.lenses.size());
  put_text(summary.file, out.file);
  if (!summary.report) return out;
  out.has_report = 1;
  out.geometry_time_s = summary.report->geometry_time_s;
  out.photometry_time_s = summary.report->photometry_time_s;
  out.rms_px = summary.report->rms_px;
  out.points = summary.report->points;
  return out;
}

lw_lens lens_as_c(const CalibrationSummary& summary, std::size_t k) {
  const LensSummary& lens = summary.lenses[k];
  lw_lens out{};
  out.size = sizeof out;
  out.width = lens.width;
  out.height = lens.height;
  out.vignetting = lens.vignetting ? 1 : 0;
  out.noise = lens.noise ? 1 : 0;
  out.max_angle_deg = lens.max_angle_deg;
  put_text(lens.model, out.model);
  put_text(lens.response, out.response);
  if (!summary.report) return out;
  if (k < summary.report->seen_deg.size()) out.seen_deg = summary.report->seen_deg[k];
  if (k < summary.report->direction_3_sigma_deg.size())
    out.direction_3_sigma_deg = summary.report->direction_3_sigma_deg[k];
  return out;
}

/// `control`: Probe::start_recording or stop_recording. The size is checked before the probe is asked.
lw_status control_recording(lw_probe* probe, Result<RecordingStatus> (Probe::*control)(), lw_recording* out) {
  return with_handle(probe, [&](Probe& p) -> Status {
    std::uint32_t size = 0;
    if (out != nullptr)
      if (Status s = size_of(out, "lw_recording", size); !s.ok()) return s;
    const Result<RecordingStatus> status = (p.*control)();
    if (!status.ok() || out == nullptr) return status.status();
    return write_sized(as_c(std::optional(*status)), "lw_recording", out);
  });
}

}  // namespace
}  // namespace lightwell::c

using namespace lightwell;
using namespace lightwell::c;

extern "C" {

lw_status lw_probe_get_recording(const lw_probe* probe, lw_recording* out) {
  return with_handle(probe, [&](const Probe& p) { return write_sized(as_c(p.info().recording), "lw_recording", out); });
}

lw_status lw_probe_start_recording(lw_probe* probe, lw_recording* out) {
  return control_recording(probe, &Probe::start_recording, out);
}

lw_status lw_probe_stop_recording(lw_probe* probe, lw_recording* out) {
  return control_recording(probe, &Probe::stop_recording, out);
}

lw_status lw_probe_get_calibration(const lw_probe* probe, lw_calibration* out, lw_lens* lenses, size_t lens_size,
                                   size_t capacity) {
  return with_handle(probe, [&](const Probe& p) -> Status {
    std::uint32_t size = 0;
    if (Status s = size_of(out, "lw_calibration", size); !s.ok()) return s;
    if (capacity > 0 && lenses == nullptr) return null_argument("lenses");
    if (capacity > 0 && (lens_size < 2 * sizeof size || lens_size > kMaxStructSize))
      return invalid("lens_size is " + std::to_string(lens_size) + "; it is sizeof(lw_lens)");
    const Result<CalibrationSummary> summary = p.calibration();
    if (!summary.ok()) return summary.status();
    auto* at = reinterpret_cast<unsigned char*>(lenses);
    for (std::size_t k = 0; k < std::min(capacity, summary->lenses.size()); ++k, at += lens_size) {
      const auto given_size = static_cast<std::uint32_t>(lens_size);
      std::memcpy(at, &given_size, sizeof given_size);
      if (Status s = write_sized(lens_as_c(*summary, k), "lw_lens", reinterpret_cast<lw_lens*>(at)); !s.ok()) return s;
    }
    return write_sized(as_c(*summary), "lw_calibration", out);
  });
}

}  // extern "C"
