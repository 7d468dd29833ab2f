#include "sim/scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace lightwell::sim {

namespace {

Panorama with_lamps_dimmed(const Panorama& lit, double factor) {
  Panorama dim = lit;
  float peak = 0;
  for (int j = 0; j < lit.height; ++j) {
    for (int i = 0; i < lit.width; ++i) peak = std::max(peak, lit.pixel(i, j).luminance());
  }
  for (std::size_t k = 0; k + 2 < dim.rgb.size(); k += 3) {
    if (Radiance{dim.rgb[k], dim.rgb[k + 1], dim.rgb[k + 2]}.luminance() <= peak / 4) continue;
    for (std::size_t c = 0; c < 3; ++c) dim.rgb[k + c] *= static_cast<float>(factor);
  }
  return dim;
}

}  // namespace

double MainsFlicker::factor(double middle_s, double exposure_s) const {
  const double half = std::numbers::pi * hz * exposure_s;
  const double kept = std::abs(half) < 1e-9 ? 1 : std::sin(half) / half;
  return 1 + depth * kept * std::sin(2 * std::numbers::pi * hz * middle_s);
}

Scene::Scene(Panorama panorama, Motion motion) : lamps_on_(std::move(panorama)), motion_(motion) {
  motion_.cycle_frames = std::max<std::uint64_t>(motion_.cycle_frames, 1);
  highlights_on_ = HighlightMask(lamps_on_);
  if (motion_.switch_period_frames == 0) return;
  lamps_off_ = with_lamps_dimmed(lamps_on_, motion_.off_factor);
  highlights_off_ = HighlightMask(lamps_off_);
}

SceneState Scene::state_at(std::uint64_t index, double offset_s) const {
  const std::uint64_t frame = index % motion_.cycle_frames;
  SceneState state;
  if (motion_.switch_period_frames > 0 && (frame / motion_.switch_period_frames) % 2 == 1)
    state.lamp_factor = motion_.off_factor;
  if (motion_.turn_rad_per_s == 0) return state;

  const auto cycle = static_cast<double>(motion_.cycle_frames);
  double phase = std::fmod(static_cast<double>(frame) + offset_s * motion_.frame_rate, cycle);
  if (phase < 0) phase += cycle;
  const double frames_forward = std::min(phase, cycle - phase);
  state.yaw_rad = motion_.turn_rad_per_s * frames_forward / motion_.frame_rate;
  state.rotation_world_probe = Quat::about({0, 1, 0}, state.yaw_rad);
  return state;
}

Radiance Scene::radiance(Vec3d direction_probe, const SceneState& state) const {
  return panorama(state).radiance(rotate(state.rotation_world_probe, direction_probe));
}

}  // namespace lightwell::sim
