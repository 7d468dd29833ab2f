// Compares the descriptor's error bound with the true error in groups of frames that are drawn from their numbers
// (README.md): prints one JSON object per group; tests/bound_campaign keeps them.
//   measure_bound_campaign --groups A B [--frames N]     groups A to before B; their first N frames [all]
//   measure_bound_campaign --group A [--frames N]        the frames of one group, an object each
// Of a group: frames; flagged: those with an infinite bound; unread: the frames between a change of a lamp and its
// being read, and how many of these are beyond their bound. Of the others: beyond, those beyond their bound; worst: the
// frame with the largest error / bound, this ratio, error and bound in percent; ratios: [k, frames] with bound / error
// from 2^(k/8) to below 2^((k+1)/8).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/query.hpp>
#include <lightwell/text.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/campaign_group.hpp"
#include "measure/output.hpp"
#include "measure/panorama_truth.hpp"
#include "measure/shots.hpp"
#include "sim/panorama.hpp"
#include "sim/scene.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
namespace ref = reference;

/// Captures of a group have numbers of their own, and so their noise.
constexpr std::uint64_t kCapturesOfGroup = 2 * measure::kGroupFrames;
constexpr double kBinsOfOctave = 8, kLargestRatio = 1e6;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_bound_campaign: %s\n", s.message().c_str());
  std::exit(1);
}

/// A rig turned by `tilt` in the world, with ideal sensors: it renders what the rig sees.
measure::Camera tilted_camera(RigParameters rig, Quat tilt) {
  for (LensParameters& lens : rig.lenses) lens.pose_cv.rotation = tilt * lens.pose_cv.rotation;
  return {rig, PixelFormat::rgb_f32};
}

struct Extent {
  double peak = 0, mean = 0;
};
/// Of all states of the light: no pixel saturates at the right exposure.
Extent extent_of(measure::Group& group) {
  Extent out;
  const measure::LightState* last = nullptr;
  for (const measure::GroupFrame& frame : group.frames) {
    if (last != nullptr && *last == frame.light) continue;
    last = &frame.light;
    group.scene.set(frame.light);
    out.peak = std::max(out.peak, measure::peak_of(group.scene.panorama().rgb));
    out.mean = std::max(out.mean, sim::mean_luminance(group.scene.panorama()));
  }
  return out;
}

struct Measured {
  double error = 0;
  bool unread = false;  ///< Between a change of a lamp and its being read.
  measure::Delivered delivered;
};

double error_of(const Descriptor& d, Quat to_probe, const std::vector<ref::Rgb>& truth) {
  std::vector<ref::Rgb> got;
  for (const ref::V3& n : measure::truth_normals()) {
    const Irradiance v = irradiance_at(d, vec_cast<float>(rotate(to_probe, Vec3d{n.x, n.y, n.z})));
    got.push_back({v.r, v.g, v.b});
  }
  const ref::IrradianceError e = ref::irradiance_error(truth, got);
  return std::max(e.rms, e.luminance_weighted);
}

/// Calls `visit` with the number of each of the first `count` frames and what was measured.
template <class Visit>
void measure_group(measure::Group& group, std::size_t count, const Visit& visit) {
  const RigParameters rig = group.rig();
  PanoramaOptions options;
  options.config = group.config;
  auto estimator = make_panorama_estimator(rig, options);
  if (!estimator) fail(estimator.status());
  const measure::Camera sensors(rig, group.sensor.format);
  measure::Camera view = tilted_camera(rig, group.tilt);

  const Extent extent = extent_of(group);
  std::vector<double> exposures = sensors.bracket_of_three(extent.peak, extent.mean);
  if (group.exposures == 1) exposures.resize(1);
  for (double& e : exposures) e *= group.exposure_factor;

  std::optional<sim::Scene> scene;
  measure::LensRadiance radiance;
  int since_change = kMaxInterleave;
  for (std::size_t i = 0; i < count; ++i) {
    const measure::GroupFrame& frame = group.frames[i];
    const measure::GroupFrame* before = i > 0 ? &group.frames[i - 1] : nullptr;
    if (before == nullptr || before->light != frame.light) {
      group.scene.set(frame.light);
      scene.emplace(group.scene.panorama());
    }
    const sim::SceneState state{Quat::about({0, 1, 0}, frame.yaw_rad), frame.yaw_rad};
    if (before == nullptr || before->light != frame.light || before->yaw_rad != frame.yaw_rad)
      radiance = view.render(*scene, state);
    const Result<measure::Delivered> out =
        measure::deliver(**estimator, sensors.expose(radiance, exposures, group.number * kCapturesOfGroup + i));
    if (!out) fail(out.status());
    since_change = frame.lamps_changed ? 0 : since_change + 1;
    const Quat to_probe = (state.rotation_world_probe * group.tilt).inverse();
    visit(i, Measured{error_of(out->descriptor, to_probe, group.scene.irradiance()),
                      since_change < group.rotation_length() - 1, *out});
  }
}

nlohmann::ordered_json description(const measure::Group& group) {
  return {{"group", group.number},
          {"scene", group.scene.name()},
          {"lens", group.lens},
          {"width", group.width},
          {"sensor", group.sensor.name},
          {"exposure", measure::to_string(group.exposure)},
          {"exposures", group.exposures},
          {"setting", to_string(group.config.setting)},
          {"interleave", group.config.panorama.interleave},
          {"max_bytes", group.config.panorama.max_bytes},
          {"smoothing", group.config.panorama.smoothing != Smoothing::none},
          {"turn", std::lround(group.turn_deg_per_s)}};
}

/// The statistics of a group.
class Tally {
 public:
  void add(std::size_t frame, const Measured& m) {
    const double bound = m.delivered.descriptor.bound.total;
    ++frames_;
    if (std::isinf(bound)) {
      ++flagged_;
      return;
    }
    const bool beyond = !(m.error <= bound);  // NaN is beyond, too.
    if (m.unread) {
      ++unread_;
      unread_beyond_ += beyond ? 1 : 0;
      return;
    }
    beyond_ += beyond ? 1 : 0;
    if (!(m.error / bound <= worst_)) {
      worst_ = m.error / bound;
      worst_at_ = {m.error / bound, 100 * m.error, 100 * bound};
      worst_frame_ = frame;
    }
    const double ratio = std::clamp(bound / m.error, 1 / kLargestRatio, kLargestRatio);
    ++ratios_[static_cast<int>(std::floor(kBinsOfOctave * std::log2(ratio)))];
  }
  void describe(nlohmann::ordered_json& line) const {
    line["frames"] = frames_;
    line["flagged"] = flagged_;
    line["unread"] = {unread_, unread_beyond_};
    line["beyond"] = beyond_;
    if (!worst_at_.empty())
      line["worst"] = {worst_frame_, rounded(worst_at_[0]), rounded(worst_at_[1]), rounded(worst_at_[2])};
    line["ratios"] = nlohmann::ordered_json::array();
    for (const auto& [bin, count] : ratios_) line["ratios"].push_back({bin, count});
  }

 private:
  /// Three digits, and no more in the text.
  static double rounded(double v) { return std::strtod(formatted("%.3g", v).c_str(), nullptr); }

  int frames_ = 0, flagged_ = 0, unread_ = 0, unread_beyond_ = 0, beyond_ = 0;
  double worst_ = 0;
  std::size_t worst_frame_ = 0;
  std::vector<double> worst_at_;  ///< Error by bound, error and bound in percent; empty without a frame.
  std::map<int, int> ratios_;
};

void print_frame(std::size_t number, const measure::GroupFrame& frame, const Measured& m) {
  const Descriptor& d = m.delivered.descriptor;
  nlohmann::ordered_json flags = nlohmann::ordered_json::array();
  for (const Flag flag : kFlags)
    if (d.flags.has(flag)) flags.push_back(to_string(flag));
  measure::print_line({{"frame", number},
                       {"lamps_changed", frame.lamps_changed},
                       {"gain", frame.light.gain},
                       {"unread", m.unread},
                       {"error", m.error},
                       {"bound", d.bound.total},
                       {"truncation", d.bound.truncation},
                       {"sampling", d.bound.sampling},
                       {"noise", d.bound.noise},
                       {"quantization", d.bound.quantization},
                       {"smoothing", d.bound.smoothing},
                       {"flags", flags},
                       {"lights", d.lights.size()},
                       {"band", d.radiance.band},
                       {"bytes", m.delivered.bytes}});
}

measure::Group drawn(std::uint32_t number) {
  Result<measure::Group> group = measure::draw_group(number);
  if (!group) fail(group.status());
  return std::move(*group);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::uint32_t> range;
  std::optional<std::uint32_t> one;
  std::size_t frames = measure::kGroupFrames;
  CLI::App app{"Compares the descriptor's error bound with the true error in drawn groups of frames.",
               "measure_bound_campaign"};
  CLI::Option* groups = app.add_option("--groups", range, "Groups A to before B")->expected(2);
  app.add_option("--group", one, "Prints the frames of this group")->excludes(groups);
  app.add_option("--frames", frames, "The first frames of each group [all]")
      ->check(CLI::Range(1, measure::kGroupFrames));
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  if (one) {
    measure::Group group = drawn(*one);
    measure::print_line(description(group));
    measure_group(group, frames,
                  [&](std::size_t frame, const Measured& m) { print_frame(frame, group.frames[frame], m); });
    return 0;
  }
  if (range.empty()) return wrong_usage(app, "give --groups or --group");
  for (std::uint32_t number = range[0]; number < range[1]; ++number) {
    measure::Group group = drawn(number);
    Tally tally;
    measure_group(group, frames, [&](std::size_t frame, const Measured& m) { tally.add(frame, m); });
    nlohmann::ordered_json line = description(group);
    tally.describe(line);
    measure::print_line(line);
  }
  return 0;
}
