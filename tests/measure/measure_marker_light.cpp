// Results of lightwelld's marker estimator for path-traced frames, one JSON object per line for every noisy 8-bit
// frame:
//   frame, group, body, view, place   the frame (tests/reference/mitsuba/marker/scenes.json)
//   answered, unsure                  whether there is a descriptor; whether its light is flagged as uncertain
//   ambiguous                         whether two attitudes of the body explain the tags
//   error_deg, sigma_deg, deviations2 direction of the strongest true lamp compared with the nearer of the two
//                                     strongest estimated lights: the angle, the estimate's standard deviation along
//                                     the error, and the squared Mahalanobis distance of the error (two degrees of
//                                     freedom)
//   lamps                             for each true lamp: error_deg; color (largest relative error of r, g, b,
//                                     normalized to equal sums); irradiance (relative error of the sum); position
//                                     (error relative to the distance) and distance, if the light's distance is
//                                     observable
//   irradiance_rms                    relative RMS error of irradiance over normals within 60 degrees of the camera;
//   the
//                                     truth is all light, the board's included
//   strongest_share, faces_lit        in a room: the share of the strongest light in the irradiance of a surface that
//                                     faces it; the number of visible faces that it lights
//   found, near, shadow               number of estimated lights; whether the distance of the first is observable;
//                                     whether the shadow on the table was used
// Usage: --help.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "app/tag_body_finder.hpp"
#include "estimate/marker/marker_estimator.hpp"
#include "measure/direction_error.hpp"
#include "measure/output.hpp"
#include "measure/traced_frames.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;

constexpr double kDegree = std::numbers::pi / 180;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_marker_light: %s\n", s.message().c_str());
  std::exit(1);
}

double sum(const std::array<double, 3>& c) { return c[0] + c[1] + c[2]; }

/// The descriptor's light that is nearest to a direction; null if it has none.
const Light* nearest_light(const Descriptor& d, Vec3d direction) {
  const auto angle = [&](const Light& light) { return angle_between(vec_cast<double>(light.direction), direction); };
  const auto found = std::ranges::min_element(d.lights, {}, angle);
  return found == d.lights.end() ? nullptr : &*found;
}

void print(const measure::TracedFrame& frame, const measure::TrueIrradiance& all_light, bool answered,
           const Descriptor& out, const MarkerReport& report) {
  nlohmann::ordered_json line = {{"frame", frame.name}, {"group", frame.group}, {"body", frame.body},
                                 {"view", frame.view},  {"place", frame.place}, {"answered", answered}};
  if (!answered) {
    line["unsure"] = true;
    measure::print_line(line);
    return;
  }
  const auto& lights = report.light.lights;
  line["unsure"] = out.flags.has(Flag::unsure);
  line["ambiguous"] = report.body.ambiguous;
  line["found"] = lights.size();
  line["shadow"] = report.light.surround_model == marker::SurroundModel::ground_plane_with_shadow;
  line["near"] = !lights.empty() && lights[0].distance_observable;
  line["irradiance_rms"] = measure::irradiance_error(all_light, out);
  if (!frame.normals.empty()) {
    line["strongest_share"] = frame.strongest_share;
    line["faces_lit"] = frame.lamps[0].visible_lit_faces;
  }
  line["left_out"] = report.light.outliers;
  line["used"] = report.light.used;
  line["chi2"] = report.light.chi_square;
  if (!lights.empty() && !frame.lamps.empty()) {
    const Vec3d truth = frame.lamps[0].direction;
    // With two lamps, the weaker one may be the first estimated light.
    std::size_t which = 0;
    for (std::size_t k = 1; k < std::min(lights.size(), frame.lamps.size()); ++k)
      if (angle_between(lights[k].light.direction, truth) < angle_between(lights[which].light.direction, truth))
        which = k;
    const measure::DirectionError error =
        measure::direction_error(lights[which].light.direction, lights[which].direction_covariance, truth);
    line["error_deg"] = error.angle_rad / kDegree;
    line["sigma_deg"] = error.sigma_rad / kDegree;
    line["deviations2"] = error.mahalanobis2;
    line["lamps"] = nlohmann::ordered_json::array();
    for (const measure::TracedLamp& lamp : frame.lamps) {
      const marker::LightEstimate* nearest = &lights[0];
      for (const marker::LightEstimate& one : lights)
        if (angle_between(one.light.direction, lamp.direction) <
            angle_between(nearest->light.direction, lamp.direction))
          nearest = &one;
      const auto& e = nearest->light.irradiance;
      double color = 0;
      for (std::size_t k = 0; k < 3; ++k)
        color = std::max(color, std::abs(e[k] / sum(e) * sum(lamp.irradiance) / lamp.irradiance[k] - 1));
      nlohmann::ordered_json errors = {{"error_deg", angle_between(nearest->light.direction, lamp.direction) / kDegree},
                                       {"color", color},
                                       {"irradiance", sum(e) / sum(lamp.irradiance) - 1}};
      if (nearest->distance_observable && lamp.distance_m > 0) {
        const Vec3d at = nearest->light.direction * (1 / nearest->light.inverse_distance);
        errors["position"] = length(at - lamp.direction * lamp.distance_m) / lamp.distance_m;
        errors["distance"] = 1 / nearest->light.inverse_distance / lamp.distance_m - 1;
      }
      if (const Light* sent = nearest_light(out, lamp.direction); sent != nullptr && sent->distance_m > 0) {
        errors["distance_m"] = sent->distance_m;
        errors["distance_sigma_m"] = sent->distance_sigma_m;
        // Of the inverse distance, which is closer to a normal distribution; that of a distant lamp is 0.
        const double d = sent->distance_m, inverse_sigma = sent->distance_sigma_m / (d * d);
        errors["distance_deviations"] = (1 / d - (lamp.distance_m > 0 ? 1 / lamp.distance_m : 0)) / inverse_sigma;
      }
      line["lamps"].push_back(std::move(errors));
    }
  }
  measure::print_line(line);
}

void print_result(const measure::TracedFrame& frame, const MarkerReport& report) {
  const Pose off = compose(inverse(frame.probe_body), report.body.probe_body.pose);
  const auto& c = report.body.probe_body.covariance;
  std::fprintf(stderr, "  pose off by %.3f deg (sigma %.3f), %.4f of its distance\n",
               2 * std::acos(std::min(1.0, std::abs(off.rotation.w))) / kDegree,
               std::sqrt(c[0][0] + c[1][1] + c[2][2]) / kDegree,
               length(report.body.probe_body.pose.translation - frame.probe_body.translation) /
                   length(frame.probe_body.translation));
  const auto& l = report.light;
  std::fprintf(stderr,
               "  patches %d faces %d small %d uneven %d clipped %d used %d left out %d chi2 %.2f shadow %d tags %d "
               "ambient %.3f (%.3f %.3f %.3f)\n",
               report.counts.patches, report.counts.faces, report.counts.too_small, report.counts.nonuniform,
               report.counts.clipped, l.used, l.outliers, l.chi_square,
               l.surround_model == marker::SurroundModel::ground_plane_with_shadow, report.body.tags, l.ambient[0][1],
               l.ambient[1][1], l.ambient[2][1], l.ambient[3][1]);
  for (const marker::LightEstimate& light : l.lights)
    std::fprintf(stderr, "  lamp (%.3f %.3f %.3f) w %.2f +- %.2f irradiance %.3f %.3f %.3f sigma %.2f deg%s%s\n",
                 light.light.direction.x, light.light.direction.y, light.light.direction.z,
                 light.light.inverse_distance, light.inverse_distance_sigma, light.light.irradiance[0],
                 light.light.irradiance[1], light.light.irradiance[2],
                 std::sqrt(std::max(light.direction_covariance[0], light.direction_covariance[2])) / kDegree,
                 light.distance_observable ? " near" : "", light.uncertain ? " unsure" : "");
}

}  // namespace

int main(int argc, char** argv) {
  std::string frames_folder = LIGHTWELL_MARKER_FRAMES, bodies_folder = LIGHTWELL_MARKER_BODIES, group, only;
  int noisy = 10;
  bool verbose = false, linear = false;
  CLI::App app{"Results of the marker estimator for path-traced frames.", "measure_marker_light"};
  app.add_option("--noisy", noisy, "Noisy 8-bit frames of each image [10]")->check(CLI::PositiveNumber);
  app.add_option("--group", group, "grid, low, air, two, near, panorama, ... [all]");
  app.add_option("--frame", only, "One image [all]");
  app.add_flag("--linear", linear, "Linear response instead of sRGB");
  app.add_flag("--verbose", verbose, "All estimated lights and the sample counts on standard error");
  app.add_option("--frames", frames_folder, "Folder of scenes.json and the images [tests/reference/mitsuba/marker]");
  app.add_option("--bodies", bodies_folder, "Folder of the marker bodies [firmware/estimate/marker/bodies]");
  app.footer("Exit status: 0 measured, 1 failed, 2 wrong usage.");
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  measure::TracedSensor sensor;
  sensor.srgb = !linear;
  const auto frames = measure::load_traced_frames(frames_folder);
  if (!frames) fail(frames.status());
  const auto bodies = measure::load_traced_bodies(bodies_folder);
  if (!bodies) fail(bodies.status());
  std::uint64_t number = 0;
  for (const measure::TracedFrame& frame : *frames) {
    if ((!group.empty() && frame.group != group) || (!only.empty() && frame.name != only)) continue;
    const MarkerBody& body = bodies->at(frame.body);
    const auto picture = measure::TracedPicture::load(frames_folder, frame, body);
    if (!picture) fail(picture.status());
    const RigParameters rig = picture->rig_for(sensor);
    const measure::TrueIrradiance truth = measure::irradiance_facing_camera(frame);
    for (int k = 0; k < noisy; ++k) {
      const measure::Shot shot = picture->expose(sensor, number++);
      Result<std::unique_ptr<BodyFinder>> finder = make_tag_body_finder(rig, body);
      if (!finder) fail(finder.status());
      auto estimator = make_marker_estimator(rig, body, std::move(*finder), {});
      if (!estimator) fail(estimator.status());
      Descriptor out;
      const Status s = (*estimator)->estimate(shot.frames, out);
      if (!s.ok() && s.code() != StatusCode::not_found) fail(s);
      print(frame, truth, s.ok(), out, (*estimator)->report());
      if (verbose) print_result(frame, (*estimator)->report());
    }
  }
  return 0;
}
