#include "camera/backends/sim/lens_renderer.hpp"

#include <cstddef>

namespace lightwell {

void LensRenderer::radiance(const sim::Scene& scene, std::uint64_t index, std::span<float> out) const {
  if (timing.readout_s == 0 || scene.motion().turn_rad_per_s == 0) {
    rays.render(scene, scene.state_at(index), {0, rays.height()}, out);
    return;
  }
  // Rolling shutter: each row has its own time; the centre row has the frame's.
  for (int j = 0; j < rays.height(); ++j) {
    const double offset_s = (j - (rays.height() - 1) / 2.0) * timing.readout_s;
    rays.render(scene, scene.state_at(index, offset_s), {j, j + 1}, out);
  }
}

void LensRenderer::flicker(std::uint64_t index, double exposure_s, std::span<const float> steady,
                           std::span<float> out) const {
  const double exposed_s = timing.takes_time ? exposure_s : 0;
  const double middle_s = static_cast<double>(index) / timing.frame_rate - exposed_s / 2;
  const auto width = 3 * static_cast<std::size_t>(rays.width());
  for (int j = 0; j < rays.height(); ++j) {
    const double row_s = middle_s + (j - (rays.height() - 1) / 2.0) * timing.readout_s;
    const auto factor = static_cast<float>(timing.flicker.factor(row_s, exposed_s));
    const std::size_t begin = static_cast<std::size_t>(j) * width;
    for (std::size_t k = begin; k < begin + width; ++k) out[k] = steady[k] * factor;
  }
}

bool same_light(const sim::Scene& scene, std::uint64_t index, std::uint64_t other) {
  if (index == other) return true;
  return scene.motion().turn_rad_per_s == 0 && scene.state_at(index).lamp_factor == scene.state_at(other).lamp_factor;
}

}  // namespace lightwell
