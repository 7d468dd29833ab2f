#include "estimate/specular/environment_picture.hpp"

#include <algorithm>
#include <numbers>
#include <span>

#include <lightwell/equirect.hpp>

namespace lightwell::specular {

RigParameters EnvironmentPicture::rig() {
  RigParameters out;
  out.lenses = {{kWidth, kHeight, EquirectangularParameters{}, std::numbers::pi, {upright_lens_cv(), {}}, {}}};
  return out;
}

void EnvironmentPicture::render(const GlossEstimate& estimate, const Pose& probe_plane) {
  if (direction_.empty()) {
    for (int j = 0; j < kHeight; ++j)
      for (int i = 0; i < kWidth; ++i)
        direction_.push_back(vec_cast<float>(equirect_direction((i + 0.5) / kWidth, (j + 0.5) / kHeight)));
    pixels_.resize(3 * direction_.size());
  }
  const GlossEnvironment& environment = estimate.environment;
  const Quat plane_probe = probe_plane.rotation.inverse();
  for (std::size_t pixel = 0; pixel < direction_.size(); ++pixel) {
    const Vec3f d = rotate(plane_probe, direction_[pixel]);
    Radiance value = estimate.plane;
    if (d.z > 0) {
      const auto where = environment.grid.interpolate(d);
      value = {};
      for (std::size_t k = 0; k < 3; ++k) value += where.weight[k] * environment.radiance[where.node[k]];
    }
    for (int c = 0; c < 3; ++c) pixels_[3 * pixel + static_cast<std::size_t>(c)] = std::max(value[c], 0.0F);
  }
}

Frame EnvironmentPicture::frame(const FrameInfo& info) const {
  Frame out;
  out.info = info;
  out.add_view(
      {0, PixelFormat::rgb_f32, kWidth, kHeight, kWidth * 3 * sizeof(float), std::as_bytes(std::span(pixels_))});
  return out;
}

}  // namespace lightwell::specular
