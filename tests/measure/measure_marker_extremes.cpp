// Results of lightwelld's marker estimator for difficult images and for images without a marker: one JSON object per
// line for every case (tests/firmware/estimate/marker/extreme_scenes.cpp) and noise seed:
//   extreme                name of the case
//   outcome                refused, flagged, right, wrong (extreme_scenes.hpp); for a sequence of frames the worst one
//   easy                   whether nothing prevents an estimate in this case
//   error_deg, sigma_deg   of the strongest estimated light; null if there is none
//   deviations2            squared Mahalanobis distance of the error
//   why                    the error message, the flags, or what is wrong
// Usage: --help.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <string>

#include <nlohmann/json.hpp>

#include "firmware/estimate/marker/extreme_scenes.hpp"
#include "measure/output.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell::marker::test;

void print_result(const Evaluation& v) {
  const lightwell::MarkerReport& r = v.report;
  const lightwell::marker::LightingEstimate& l = r.light;
  std::fprintf(stderr,
               "  tags %d%s, patches %d, faces %d, small %d, uneven %d, covered %d, clipped %d; used %d, left out %d, "
               "chi2 %.2f%s%s\n",
               r.body.tags, r.body.ambiguous ? " ambiguous" : "", r.counts.patches, r.counts.faces, r.counts.too_small,
               r.counts.nonuniform, r.counts.occluded, r.counts.clipped, l.used, l.outliers, l.chi_square,
               l.surround_model == lightwell::marker::SurroundModel::ground_plane_with_shadow ? ", shadow" : "",
               l.uncertain ? ", unsure" : "");
  for (const lightwell::marker::LightEstimate& light : l.lights) {
    const lightwell::Vec3d& d = light.light.direction;
    std::fprintf(stderr, "  lamp (%.3f %.3f %.3f) 1/m %.2f, irradiance %.4g, sigma %.2f deg%s%s\n", d.x, d.y, d.z,
                 light.light.inverse_distance, light.light.irradiance[1],
                 57.3 * std::sqrt(std::max(light.direction_covariance[0], light.direction_covariance[2])),
                 light.distance_observable ? ", near" : "", light.uncertain ? ", unsure" : "");
  }
}

int measure(const std::string& bodies, const std::string& part, int seeds, bool verbose) {
  for (ExtremeCase& one : extreme_cases(bodies)) {
    if (one.name.find(part) == std::string::npos) continue;
    const ExtremePicture picture(std::move(one));
    for (int seed = 1; seed <= seeds; ++seed) {
      const Evaluation v = picture.worst(static_cast<std::uint64_t>(seed));
      const auto of_light = [&](double value) {
        return v.direction ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
      };
      lightwell::measure::print_line({{"extreme", picture.what().name},
                                      {"outcome", name_of(v.outcome)},
                                      {"easy", picture.what().easy},
                                      {"error_deg", of_light(v.error_deg)},
                                      {"sigma_deg", of_light(v.sigma_deg)},
                                      {"deviations2", of_light(v.squared_mahalanobis)},
                                      {"why", v.why}});
      if (verbose) print_result(v);
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::string bodies = LIGHTWELL_MARKER_BODIES, part;
  int seeds = 10;
  bool verbose = false;
  CLI::App app{"Results of the marker estimator for difficult images.", "measure_marker_extremes"};
  app.add_option("--seeds", seeds, "Noisy images of each case [10]")->check(CLI::PositiveNumber);
  app.add_option("--case", part, "Only cases whose name contains this [all]");
  app.add_flag("--verbose", verbose, "Details of the estimates on standard error");
  app.add_option("--bodies", bodies, "Folder of the marker bodies [firmware/estimate/marker/bodies]");
  app.footer("Exit status: 0 measured, 1 failed, 2 wrong usage.");
  if (const auto exit = lightwell::parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  try {
    return measure(bodies, part, seeds, verbose);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "measure_marker_extremes: %s\n", e.what());
    return 1;
  }
}
