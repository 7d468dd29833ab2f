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
#include <cstdlib>
#include <exception>
#include <string>

#include <lightwell/json.hpp>

#include "firmware/estimate/marker/extreme_scenes.hpp"

namespace {

using namespace lightwell::marker::test;

constexpr const char* kUsage =
    "usage: measure_marker_extremes [--seeds N] [--case PART] [--verbose] [--bodies FOLDER]\n"
    "Results of the marker estimator for difficult images, one JSON object per line.\n"
    "  --seeds N     noisy images of each case [10]\n"
    "  --case PART   only cases whose name contains PART [all]\n"
    "  --verbose     details of the estimates on standard error\n"
    "  --bodies FOLDER  folder of the marker bodies [firmware/estimate/marker/bodies]\n"
    "Exit status: 0 measured, 1 failed, 2 wrong usage.\n";

void print_number(const char* name, bool there, double value) {
  if (there && std::isfinite(value))
    std::printf(", \"%s\": %.4g", name, value);
  else
    std::printf(", \"%s\": null", name);
}

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
      std::printf("{\"extreme\": %s, \"outcome\": \"%s\", \"easy\": %s",
                  lightwell::json_string(picture.what().name).c_str(), name_of(v.outcome),
                  picture.what().easy ? "true" : "false");
      print_number("error_deg", v.direction.has_value(), v.error_deg);
      print_number("sigma_deg", v.direction.has_value(), v.sigma_deg);
      print_number("deviations2", v.direction.has_value(), v.squared_mahalanobis);
      std::printf(", \"why\": %s}\n", lightwell::json_string(v.why).c_str());
      if (verbose) print_result(v);
    }
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::string bodies = LIGHTWELL_MARKER_BODIES, part;
  int seeds = 10;
  bool verbose = false;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--help") return std::printf("%s", kUsage), 0;
    if (word == "--verbose") {
      verbose = true;
    } else if (i + 1 < argc && word == "--seeds") {
      seeds = std::atoi(argv[++i]);
    } else if (i + 1 < argc && word == "--case") {
      part = argv[++i];
    } else if (i + 1 < argc && word == "--bodies") {
      bodies = argv[++i];
    } else {
      return std::fprintf(stderr, "%s", kUsage), 2;
    }
  }
  if (seeds < 1) return std::fprintf(stderr, "%s", kUsage), 2;
  try {
    return measure(bodies, part, seeds, verbose);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "measure_marker_extremes: %s\n", e.what());
    return 1;
  }
}
