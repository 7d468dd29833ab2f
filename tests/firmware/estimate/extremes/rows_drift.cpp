// Very many frames.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {
namespace {

/// An estimator that processes frames at 30 frames/s.
class EstimatorRun {
 public:
  EstimatorRun(const RigParameters& rig, const EstimatorConfig& config) : estimator_(estimator_of(rig, config)) {}

  void process(Shot& shot, Descriptor& d, Tally& tally) {
    shot.frame.info.sequence = static_cast<std::uint64_t>(processed_);
    shot.frame.info.mid_exposure = {1'000'000'000LL + processed_ * 33'333'333LL};
    ++processed_;
    ++tally.answers;
    if (!estimator_->estimate(std::span(&shot.frame, 1), d).ok()) ++tally.refused;
    // Encodes one frame in a thousand; otherwise checks one coefficient, because NaN persists.
    else if (processed_ % 1000 == 0 ? !sound(d) : !std::isfinite(d.radiance.c[0].g))
      ++tally.unsound;
    if (d.flags.any()) ++tally.flagged;
  }

 private:
  std::unique_ptr<Estimator> estimator_;
  std::int64_t processed_ = 0;
};

Descriptor mean_light_of(const std::vector<Descriptor>& frames) {
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
  // A third of the frames for each part, in complete cycles.
  const int cycles = std::max(4, frames / 3 / kCycle);
  const auto normals = reference::fibonacci_normals(64);
  const RigRenderer codes(rig_of("equirect", 16, 8, PixelFormat::rgb8)), floats(rig_of("equirect", 32, 16));
  Chance chance(51);
  const Pictures dim = codes.render(room(chance, 0));
  Descriptor d;

  EstimatorRun still(codes.rig(), choice(Setting::balanced, 0.01));
  Shot same = codes.as_rgb8(dim, 3e-4, 0);
  Descriptor tenth;
  for (int i = 0; i < cycles * kCycle; ++i) {
    still.process(same, d, row.tally);
    if (i == 9) tenth = d;
  }
  row.still = largest_difference(tenth, d, normals);

  EstimatorRun noisy(codes.rig(), choice(Setting::balanced, 0.01));
  std::vector<Shot> shots;
  for (std::uint64_t i = 0; i < kCycle; ++i) shots.push_back(codes.as_rgb8(dim, 3e-4, i));
  std::vector<Descriptor> third(kCycle), last(kCycle);
  for (int c = 0; c < cycles; ++c)
    for (std::size_t i = 0; i < kCycle; ++i) {
      noisy.process(shots[i], d, row.tally);
      if (c == 2) third[i] = d;
      last[i] = d;
    }
  row.noisy = largest_difference(mean_light_of(third), mean_light_of(last), normals);

  EstimatorRun moving(floats.rig(), choice(Setting::balanced, 0.01));
  std::vector<Shot> rounds;
  for (int i = 0; i < kCycle; ++i) {
    const double a = 2 * std::numbers::pi * i / kCycle;
    Scene scene = constant({1, 1, 1});
    // The lamp is off for a fifth of the frames.
    if (i % 10 < 8) scene.discs.push_back({normalized(Vec3d{std::sin(a), 0.4, std::cos(a)}), 0.2, {500, 400, 300}});
    rounds.push_back(floats.as_floats(floats.render(scene)));
  }
  for (int c = 0; c < cycles; ++c)
    for (std::size_t i = 0; i < kCycle; ++i) {
      moving.process(rounds[i], d, row.tally);
      if (c == 2) third[i] = d;
      last[i] = d;
      for (const Light& l : d.lights) row.highest_track = std::max(row.highest_track, l.track);
    }
  for (std::size_t i = 0; i < kCycle; ++i)
    row.lamp = std::max(row.lamp, largest_difference(third[i], last[i], normals));
  return row;
}

}  // namespace lightwell::extremes
