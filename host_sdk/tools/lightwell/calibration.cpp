#include <array>
#include <cstdio>
#include <ctime>
#include <string>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "common.hpp"

namespace lightwell::tool {
namespace {

nlohmann::ordered_json json_of(const CalibrationSummary& calibration) {
  nlohmann::ordered_json lenses = nlohmann::ordered_json::array();
  for (const LensSummary& lens : calibration.lenses)
    lenses.push_back({{"width", lens.width},
                      {"height", lens.height},
                      {"model", lens.model},
                      {"max_angle_deg", lens.max_angle_deg},
                      {"response", lens.response},
                      {"vignetting", lens.vignetting},
                      {"noise", lens.noise}});
  nlohmann::ordered_json out = {{"id", calibration.id},
                                {"file", calibration.file},
                                {"absolute", calibration.absolute},
                                {"lenses", std::move(lenses)}};
  if (const std::optional<CalibrationReport>& report = calibration.report)
    out["report"] = {{"geometry_time_s", report->geometry_time_s},
                     {"rms_px", report->rms_px},
                     {"points", report->points},
                     {"seen_deg", report->seen_deg},
                     {"direction_3_sigma_deg", report->direction_3_sigma_deg},
                     {"photometry_time_s", report->photometry_time_s}};
  return out;
}

/// "2026-01-31", UTC; "never" for 0.
std::string date_text(std::int64_t time_s) {
  const auto time = static_cast<std::time_t>(time_s);
  std::tm utc{};
  std::array<char, 32> text{};
  if (time_s <= 0 || gmtime_r(&time, &utc) == nullptr) return "never";
  (void)std::strftime(text.data(), text.size(), "%Y-%m-%d", &utc);
  return text.data();
}

}  // namespace

int run_calibration(const Options& options) {
  const CalibrationSummary calibration = require(connect(options).calibration());
  if (options.json) {
    print_json(json_of(calibration));
    return kOk;
  }
  std::printf("calibration  %08x, %s\n", calibration.id,
              calibration.file.empty() ? "the camera's own" : printable(calibration.file).c_str());
  std::printf("units        %s\n", calibration.absolute ? "absolute, cd/m2" : "relative");
  for (std::size_t k = 0; k < calibration.lenses.size(); ++k) {
    const LensSummary& lens = calibration.lenses[k];
    std::printf("lens %zu       %ux%u, %s up to %.4g deg, response %s, vignetting %s, noise %s\n", k, lens.width,
                lens.height, printable(lens.model).c_str(), lens.max_angle_deg, lens.response.c_str(),
                lens.vignetting ? "corrected" : "not corrected", lens.noise ? "known" : "not known");
  }
  if (!calibration.report) {
    std::printf("report       none\n");
    return kOk;
  }
  const CalibrationReport& report = *calibration.report;
  std::printf("geometry     %s, %.3f px RMS over %u points\n", date_text(report.geometry_time_s).c_str(), report.rms_px,
              report.points);
  for (std::size_t k = 0; k < report.seen_deg.size() && k < report.direction_3_sigma_deg.size(); ++k)
    std::printf("lens %zu       boards seen up to %.1f deg, directions accurate to %.3g deg (3 sigma)\n", k,
                report.seen_deg[k], report.direction_3_sigma_deg[k]);
  std::printf("photometry   %s\n", date_text(report.photometry_time_s).c_str());
  return kOk;
}

}  // namespace lightwell::tool
