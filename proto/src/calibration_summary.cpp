#include <array>
#include <utility>

#include <lightwell/calibration_summary.hpp>
#include <lightwell/text.hpp>

#include "messages.hpp"

namespace lightwell {
namespace {

constexpr std::size_t kMaxFileName = 256;
constexpr std::array<std::pair<v1::Response::Kind, std::string_view>, 4> kResponses = {
    {{v1::Response::LINEAR, "linear"},
     {v1::Response::SRGB, "srgb"},
     {v1::Response::TABLE, "table"},
     {v1::Response::GAMMA, "gamma"}}};

}  // namespace

std::string_view response_name(v1::Response::Kind kind) {
  for (const auto& [known, name] : kResponses)
    if (known == kind) return name;
  return "unknown";
}

void fill_report(const CalibrationReport& report, v1::CalibrationReport& m) {
  m.set_geometry_time_s(report.geometry_time_s);
  m.set_rms_px(report.rms_px);
  m.set_points(report.points);
  m.mutable_seen_deg()->Assign(report.seen_deg.begin(), report.seen_deg.end());
  m.mutable_direction_3_sigma_deg()->Assign(report.direction_3_sigma_deg.begin(), report.direction_3_sigma_deg.end());
  m.set_photometry_time_s(report.photometry_time_s);
}

CalibrationReport report_from(const v1::CalibrationReport& m) {
  return {m.geometry_time_s(),
          m.rms_px(),
          m.points(),
          {m.seen_deg().begin(), m.seen_deg().end()},
          {m.direction_3_sigma_deg().begin(), m.direction_3_sigma_deg().end()},
          m.photometry_time_s()};
}

void fill_calibration(const CalibrationSummary& calibration, v1::GetCalibrationResponse& m) {
  m.set_calibration_id(calibration.id);
  m.set_file(truncated(calibration.file, kMaxFileName));
  m.set_absolute(calibration.absolute);
  for (const LensSummary& lens : calibration.lenses) {
    v1::LensSummary& out = *m.add_lens();
    out.set_width(lens.width);
    out.set_height(lens.height);
    out.set_model(lens.model);
    out.set_max_angle_deg(lens.max_angle_deg);
    for (const auto& [kind, name] : kResponses)
      if (name == lens.response) out.set_response(kind);
    out.set_vignetting(lens.vignetting);
    out.set_noise(lens.noise);
  }
  if (calibration.report) fill_report(*calibration.report, *m.mutable_report());
}

CalibrationSummary calibration_from(const v1::GetCalibrationResponse& m) {
  CalibrationSummary out{m.calibration_id(), m.file(), m.absolute(), {}, {}};
  for (const v1::LensSummary& lens : m.lens())
    out.lenses.push_back({lens.width(), lens.height(), lens.model(), lens.max_angle_deg(),
                          std::string(response_name(lens.response())), lens.vignetting(), lens.noise()});
  if (m.has_report()) out.report = report_from(m.report());
  return out;
}

}  // namespace lightwell
