// Virtual objects beside real ones: path-traced trials (tests/reference/mitsuba/viewer) seen by a simulated probe.
// Prints one JSON object per line for tests/figures.
//   measure_viewer [--write FOLDER]     estimates the light of each trial; "place": probe at the object's top, or away
//     trial, place, distance_m, width   the trial
//     elevation_error_deg, azimuth_error_deg, direction_error_deg   of the strongest light against the lamp
//     shadow_elevation_error_deg, shadow_azimuth_error_deg          of the shadow of the SDK's ShadowCaster against the
//                                       real one, by the place of the tip
//     outline_median_px, outline_95_px  distance between the outlines of both
//     With --write: FOLDER/TRIAL_PLACE_METHOD.json, scenes for ar_viewer, the descriptors, and turning.lwrec, a light
//     that changes in each of 60 frames.
//   measure_viewer --compare FOLDER     the pictures that ar_viewer made of them, in FOLDER/TRIAL_PLACE_METHOD/: the
//     shadow_ and outline_ values above, and
//     shading_error, shadow_error       mean absolute difference to the path-traced picture: of the object's pixels
//                                       relative to their mean; of the light ratio on the table around it
// --trials FOLDER: as render.py writes them. --trial NAME: one trial alone. --true-distance: the strongest light gets
// the lamp's distance, which a panorama does not show: what the missing distance costs. Methods: constant, s0
// (Algorithm 1 of CubeMap360), main_light_and_sh9, full. Definitions: README.md of the scenes.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/codec.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/shadows.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/output.hpp"
#include "measure/shots.hpp"
#include "measure/viewer_scenes.hpp"
#include "measure/viewer_trials.hpp"
#include "sim/panorama.hpp"
#include "sim/sensor.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
using namespace lightwell::measure;
using nlohmann::ordered_json;

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kMapEdge = 64;
constexpr int kTexels = 1024;
constexpr int kSides = 96;
/// The finest: what is measured is the light. With 96 directions of the residual in cells of 8 texels the shadows of
/// two wide lamps at 1 m were off by 0.25 degrees more.
constexpr ShadowOptions kShadowOptions{1024, 1024, 1};
constexpr int kTurningFrames = 60;

/// The probe's light as an application receives it, and its message.
struct ProbeLight {
  Lighting lighting;
  std::vector<std::byte> message;
  ColorPicture panorama;
};

class Probe {
 public:
  Probe() : rig_(require(sim::make_rig("pair", 1280, 960, PixelFormat::rgb8))), camera_(rig_, PixelFormat::rgb8) {}

  ProbeLight light_of(const std::string& panorama) {
    const sim::Scene scene(require(sim::load_panorama(panorama)));
    const LensRadiance radiance = camera_.render(scene, scene.state_at(0));
    const Shot shot = camera_.expose(radiance, camera_.bracket_of_three(peak_of(radiance), mean_of(radiance)), 0);
    // A new one for each panorama: the first descriptor has a whole map, and nothing is smoothed.
    PanoramaOptions options;
    options.config.panorama.environment_edge = kMapEdge;
    const std::unique_ptr<Estimator> estimator = require(make_panorama_estimator(rig_, options));
    Delivered delivered = require(deliver(*estimator, shot));
    ProbeLight out;
    Encoder encoder;
    const auto bytes = require(encoder.encode(delivered.descriptor));
    out.message.assign(bytes.begin(), bytes.end());
    out.lighting = Lighting::of(std::move(delivered.descriptor));
    out.panorama = require(read_color_picture(panorama));
    return out;
  }

 private:
  RigParameters rig_;
  Camera camera_;
};

/// Light ratios of the table below the virtual object, by the SDK, as the camera sees them.
class TableShadow {
 public:
  explicit TableShadow(const TrialSetup& setup)
      : setup_(setup), caster_(require(ShadowCaster::make(kShadowOptions))), ratios_(kTexels * kTexels) {
    const auto r = static_cast<float>(setup.object_radius_m), h = static_cast<float>(setup.object_height_m);
    for (int i = 0; i < kSides; ++i) {
      const float a = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / kSides;
      for (const float y : {0.0F, h}) positions_.push_back({r * std::sin(a), y, r * std::cos(a)});
    }
    positions_.push_back({0, h, 0});
    for (std::uint32_t i = 0; i < kSides; ++i) {
      const std::uint32_t a = 2 * i, b = 2 * ((i + 1) % kSides);
      for (const std::uint32_t k : {a, b, b + 1, a, b + 1, a + 1, a + 1, b + 1, 2U * kSides}) indices_.push_back(k);
    }
  }

  /// NaN where `like` is.
  GreyPicture seen(const Lighting& in_world, double side_m, const GreyPicture& like) {
    // The plane's +Z is the world's +Y.
    const Pose T_world_plane{Quat::about({1, 0, 0}, -std::numbers::pi / 2), {}};
    const ShadowReceiver table{T_world_plane, side_m, side_m, kTexels, kTexels};
    const ShadowMesh mesh{positions_, indices_, inverse(T_world_plane)};
    (void)require(caster_.cast(in_world, table, mesh, ratios_));
    GreyPicture out(setup_.width, setup_.height);
    for (int y = 0; y < out.height; ++y)
      for (int x = 0; x < out.width; ++x) {
        out.at(x, y) = like.at(x, y);
        if (!std::isnan(like.at(x, y))) out.at(x, y) = at(side_m, setup_.on_table(x, y).value_or(Vec3d{}));
      }
    return box_means(out, 1);
  }

 private:
  /// Luminance ratio of an achromatic table, bilinear.
  [[nodiscard]] double at(double side_m, const Vec3d& p) const {
    const double x = std::clamp((p.x / side_m + 0.5) * kTexels - 0.5, 0.0, kTexels - 1.001);
    const double y = std::clamp((p.z / side_m + 0.5) * kTexels - 0.5, 0.0, kTexels - 1.001);
    const auto i = static_cast<std::size_t>(x), j = static_cast<std::size_t>(y);
    const double fx = x - static_cast<double>(i), fy = y - static_cast<double>(j);
    const auto value = [&](std::size_t a, std::size_t b) {
      return static_cast<double>(ratios_[b * kTexels + a].luminance());
    };
    return (value(i, j) * (1 - fx) + value(i + 1, j) * fx) * (1 - fy) +
           (value(i, j + 1) * (1 - fx) + value(i + 1, j + 1) * fx) * fy;
  }

  TrialSetup setup_;
  ShadowCaster caster_;
  std::vector<Vec3f> positions_;
  std::vector<std::uint32_t> indices_;
  std::vector<LightRatio> ratios_;
};

/// Errors of a virtual shadow against the real one. Nulls without a virtual shadow.
void add_shadow_errors(const Shadow& real, const std::optional<Shadow>& made, ordered_json& line) {
  const OutlineDistance distance = made ? outline_distance(real.outline, made->outline) : OutlineDistance{};
  line["shadow_depth_real"] = real.depth;
  line["shadow_depth"] = made ? ordered_json(made->depth) : ordered_json();
  line["shadow_elevation_error_deg"] = made ? ordered_json(made->elevation_deg - real.elevation_deg) : ordered_json();
  line["shadow_azimuth_error_deg"] =
      made ? ordered_json(angle_difference_deg(made->azimuth_deg, real.azimuth_deg)) : ordered_json();
  line["outline_median_px"] = distance.median_px;
  line["outline_95_px"] = distance.percentile_95_px;
}

struct RealPictures {
  RealPictures(const TrialSetup& setup, const ViewerTrial& trial)
      : with(require(read_color_picture(setup.folder + "/" + trial.name + "_with.jpg"))),
        without(require(read_color_picture(setup.folder + "/" + trial.name + "_without.jpg"))),
        ratio(light_ratio(setup, trial, with, without)) {
    std::optional<Shadow> found = shadow_of(setup, ratio);
    if (!found) refuse(trial.name + ": the picture with the object shows no shadow");
    shadow = std::move(*found);
  }

  ColorPicture with, without;
  GreyPicture ratio;
  Shadow shadow;
};

ordered_json head_of(const ViewerTrial& trial, const std::string& place) {
  return {{"trial", trial.name}, {"place", place}, {"distance_m", trial.distance_m}, {"width", trial.width}};
}

void add_direction_errors(const ViewerTrial& trial, const Lighting& light, ordered_json& line) {
  const std::optional<Light> main = light.primary_light();
  if (!main) {
    line["direction_error_deg"] = line["elevation_error_deg"] = line["azimuth_error_deg"] = nullptr;
    return;
  }
  const Vec3d d = normalized(vec_cast<double>(main->direction));
  const double e = trial.elevation_deg * kDegree, a = trial.azimuth_deg * kDegree;
  const Vec3d truth{std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a)};
  line["direction_error_deg"] = angle_between(d, truth) / kDegree;
  line["elevation_error_deg"] = std::asin(std::clamp(d.y, -1.0, 1.0)) / kDegree - trial.elevation_deg;
  line["azimuth_error_deg"] = angle_difference_deg(std::atan2(d.x, d.z) / kDegree, trial.azimuth_deg);
}

/// All trials, or the one of that name.
std::vector<ViewerTrial> chosen_trials(const std::string& folder, const std::string& name) {
  std::vector<ViewerTrial> trials = require(load_viewer_trials(folder));
  if (!name.empty()) std::erase_if(trials, [&](const ViewerTrial& trial) { return trial.name != name; });
  if (trials.empty()) refuse("there is no trial " + name + " in " + folder + "/trials.jsonl");
  return trials;
}

enum class Distance { as_estimated, of_the_lamp };

/// With a standard deviation of 1 cm.
Lighting with_distance(const Lighting& light, double distance_m) {
  Descriptor d = light.descriptor();
  if (!d.lights.empty()) {
    d.lights[0].distance_m = static_cast<float>(distance_m);
    d.lights[0].distance_sigma_m = 0.01F;
  }
  return Lighting::of(std::move(d));
}

void estimate_trials(const TrialSetup& setup, const std::vector<ViewerTrial>& trials, const std::string& folder,
                     Distance distance) {
  Probe probe;
  TableShadow table(setup);
  for (const ViewerTrial& trial : trials) {
    const RealPictures real(setup, trial);
    for (const std::string place : {"top", "away"}) {
      ProbeLight light = probe.light_of(setup.folder + "/" + trial.name + "_" + place + ".exr");
      if (distance == Distance::of_the_lamp && place == "top")
        light.lighting = with_distance(light.lighting, trial.distance_m);
      const Pose T_world_probe{{}, place == "top" ? trial.probe_top : trial.probe_away};
      ordered_json line = head_of(trial, place);
      line["lights"] = light.lighting.lights().size();
      line["bytes"] = light.message.size();
      add_direction_errors(trial, light.lighting, line);
      const GreyPicture made =
          table.seen(light.lighting.in_world(T_world_probe), 2 * shadow_reach_m(trial.shadow_m), real.ratio);
      add_shadow_errors(real.shadow, shadow_of(setup, made), line);
      print_line(line);
      if (folder.empty()) continue;
      require(write_viewer_scenes({setup, trial, place, T_world_probe, light.lighting, light.message, light.panorama},
                                  folder));
      if (&trial == &trials.front() && place == "top")
        require(write_turning_light(light.lighting.descriptor(), kTurningFrames, folder));
    }
  }
}

/// Mean absolute difference of two pictures on the object, relative to the mean of the real one, which is clipped at 1.
double shading_error(const TrialSetup& setup, const ColorPicture& real, const ColorPicture& made) {
  const std::vector<Seen> seen = seen_by(setup);
  double difference = 0, sum = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i] != Seen::object) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const double shown = std::min(static_cast<double>(made.values[i][c]), 1.0);
      difference += std::abs(shown - static_cast<double>(real.values[i][c]));
      sum += static_cast<double>(real.values[i][c]);
    }
  }
  return difference / sum;
}

double shadow_error(const GreyPicture& real, const GreyPicture& made) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < real.values.size(); ++i)
    if (!std::isnan(real.values[i])) sum += std::abs(made.values[i] - real.values[i]), ++count;
  return sum / count;
}

void compare(const TrialSetup& setup, const std::vector<ViewerTrial>& trials, const std::string& folder) {
  for (const ViewerTrial& trial : trials) {
    const RealPictures real(setup, trial);
    for (const std::string place : {"top", "away"})
      for (const std::string_view method : kViewerMethods) {
        const std::string made_in = viewer_scene_name(folder, trial, place, method);
        if (!std::filesystem::exists(made_in + "/frame_0000.exr")) continue;
        const ColorPicture picture = require(read_color_picture(made_in + "/frame_0000.exr"));
        const ColorPicture shadow = require(read_color_picture(made_in + "/shadow_0000.exr"));
        ColorPicture one = shadow;
        for (auto& v : one.values) v = {1, 1, 1};
        const GreyPicture ratio = light_ratio(setup, trial, shadow, one);
        ordered_json line = head_of(trial, place);
        line["method"] = method;
        line["shading_error"] = shading_error(setup, real.with, picture);
        line["shadow_error"] = shadow_error(real.ratio, ratio);
        add_shadow_errors(real.shadow, shadow_of(setup, ratio), line);
        print_line(line);
      }
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Virtual objects beside real ones in path-traced trials.", "measure_viewer"};
  std::string folder = LIGHTWELL_VIEWER_TRIALS, write_to, compare_in, trial;
  bool true_distance = false;
  app.add_option("--write", write_to, "also write scenes for ar_viewer to this folder, which must exist");
  app.add_option("--compare", compare_in, "compare the pictures that ar_viewer made of the scenes in this folder");
  app.add_option("--trials", folder, "folder of the trials [tests/reference/mitsuba/viewer]");
  app.add_option("--trial", trial, "one trial alone, by its name [all]");
  app.add_flag("--true-distance", true_distance, "at the object's top, give the strongest light the lamp's distance")
      ->excludes("--write")
      ->excludes("--compare");
  return run_command(app, {argv + 1, argv + argc}, [&] {
    const TrialSetup setup = require(load_trial_setup(folder));
    if (compare_in.empty())
      estimate_trials(setup, chosen_trials(folder, trial), write_to,
                      true_distance ? Distance::of_the_lamp : Distance::as_estimated);
    else
      compare(setup, chosen_trials(folder, trial), compare_in);
    return 0;
  });
}
