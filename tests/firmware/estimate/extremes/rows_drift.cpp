// A million frames.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {
namespace {

/// One estimator that is shown one picture after another at 30 frames a second.
class Watch {
 public:
  Watch(const RigParameters& rig, const EstimatorConfig& config) : estimator_(estimator_of(rig, config)) {}

  void show(Shot& shot, Descriptor& d, Tally& tally) {
    shot.frame.info.sequence = static_cast<std::uint64_t>(shown_);
    shot.frame.info.mid_exposure = {1'000'000'000LL + shown_ * 33'333'333LL};
    ++shown_;
    ++tally.answers;
    if (!estimator_->estimate(std::span(&shot.frame, 1), d).ok()) ++tally.refused;
    // Bytes are encoded now and then: a number that is not finite stays so.
    else if (shown_ % 1000 == 0 ? !sound(d) : !std::isfinite(d.radiance.c[0].g))
      ++tally.unsound;
    if (d.flags.any()) ++tally.flagged;
  }

 private:
  std::unique_ptr<Estimator> estimator_;
  std::int64_t shown_ = 0;
};

Descriptor with_light_of(const std::vector<Descriptor>& frames) {
  Descriptor mean;
  mean.radiance.band = kMaxBand;
  const float share = 1.0F / static_cast<float>(frames.size());
  for (const Descriptor& d : frames) {
    for (std::size_t i = 0; i < d.radiance.c.size(); ++i) mean.radiance.c[i] += d.radiance.c[i] * share;
    for (Light l : d.lights) {
      l.irradiance = l.irradiance * share;
      mean.lights.push_back(l);
    }
  }
  return mean;
}

}  // namespace

DriftRow many_frames(int frames) {
  DriftRow row;
  constexpr int kCycle = 50;
  // A third of the frames each; the cycles complete.
  const int cycles = std::max(4, frames / 3 / kCycle);
  const auto normals = reference::fibonacci_normals(64);
  const RigRenderer codes(rig_of("equirect", 16, 8, PixelFormat::rgb8)), floats(rig_of("equirect", 32, 16));
  Chance chance(51);
  const Pictures dim = codes.see(room(chance, 0));
  Descriptor d;

  Watch still(codes.rig(), choice(Setting::balanced, 0.01));
  Shot same = codes.as_rgb8(dim, 3e-4, 0);
  Descriptor tenth;
  for (int i = 0; i < cycles * kCycle; ++i) {
    still.show(same, d, row.tally);
    if (i == 9) tenth = d;
  }
  row.still = largest_difference(tenth, d, normals);

  Watch noisy(codes.rig(), choice(Setting::balanced, 0.01));
  std::vector<Shot> shots;
  for (std::uint64_t i = 0; i < kCycle; ++i) shots.push_back(codes.as_rgb8(dim, 3e-4, i));
  std::vector<Descriptor> third(kCycle), last(kCycle);
  for (int c = 0; c < cycles; ++c)
    for (std::size_t i = 0; i < kCycle; ++i) {
      noisy.show(shots[i], d, row.tally);
      if (c == 2) third[i] = d;
      last[i] = d;
    }
  row.noisy = largest_difference(with_light_of(third), with_light_of(last), normals);

  Watch going(floats.rig(), choice(Setting::balanced, 0.01));
  std::vector<Shot> rounds;
  for (int i = 0; i < kCycle; ++i) {
    const double a = 2 * std::numbers::pi * i / kCycle;
    Scene scene = constant({1, 1, 1});
    // It switches, too: off for a fifth of the way.
    if (i % 10 < 8) scene.discs.push_back({normalized(Vec3d{std::sin(a), 0.4, std::cos(a)}), 0.2, {500, 400, 300}});
    rounds.push_back(floats.as_floats(floats.see(scene)));
  }
  for (int c = 0; c < cycles; ++c)
    for (std::size_t i = 0; i < kCycle; ++i) {
      going.show(rounds[i], d, row.tally);
      if (c == 2) third[i] = d;
      last[i] = d;
      for (const Light& l : d.lights) row.highest_track = std::max(row.highest_track, l.track);
    }
  for (std::size_t i = 0; i < kCycle; ++i)
    row.lamp = std::max(row.lamp, largest_difference(third[i], last[i], normals));
  return row;
}

}  // namespace lightwell::extremes
