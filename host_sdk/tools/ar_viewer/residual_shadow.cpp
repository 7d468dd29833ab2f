#include "ar_viewer/residual_shadow.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "ar_viewer/box.hpp"
#include "ar_viewer/shader_program.hpp"

namespace lightwell::viewer {
namespace {

/// A change of the residual below this share of its mean is not visible in the occlusion: a step of an 8-bit picture is
/// about 1 % of a medium grey.
constexpr float kTolerance = 0.01F;
/// Rotation of the caster's plane, whose normal is +Z, into ours, whose normal is +Y: its +Y is our -Z.
const Quat kUpright = Quat::about({1, 0, 0}, -1.5707963267948966);

}  // namespace

ResidualShadow::ResidualShadow(ShadowCaster caster) : caster_(std::move(caster)) {
  ratios_.resize(static_cast<std::size_t>(kEdge) * kEdge);
  glBindTexture(GL_TEXTURE_2D, texture_.name());
  set_sampling(GL_TEXTURE_2D, GL_LINEAR, GL_LINEAR, GL_CLAMP_TO_EDGE);
}

Result<ResidualShadow> ResidualShadow::make() {
  Result<ShadowCaster> caster = ShadowCaster::make();
  if (!caster.ok()) return caster.status();
  return ResidualShadow(std::move(*caster));
}

bool ResidualShadow::unchanged(const LightState& light, const std::vector<Vec3f>& positions) const {
  const RadianceSh& now = light.residual.descriptor().radiance;
  if (!residual_ || residual_->band != now.band || positions != positions_) return false;
  const float limit = kTolerance * residual_->c[0].luminance();
  for (std::size_t i = 0; i < static_cast<std::size_t>(now.count()); ++i)
    for (int c = 0; c < 3; ++c)
      if (!(std::abs(now.c[i][c] - residual_->c[i][c]) <= limit)) return false;
  return true;
}

Result<ResidualShadow::Square> ResidualShadow::update(const LightState& light, const Ground& ground,
                                                      std::vector<Vec3f>& positions,
                                                      const std::vector<std::uint32_t>& indices) {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::residual));
  glBindTexture(GL_TEXTURE_2D, texture_.name());
  if (positions.empty()) return Square{};
  if (unchanged(light, positions)) return square_;

  const Pose T_plane_world = inverse(ground.T_world_plane);
  Box<double> box;
  for (const Vec3f& p : positions) box.add(transformed(T_plane_world, vec_cast<double>(p)));
  square_.centre_x = box.center().x;
  square_.centre_z = box.center().z;
  square_.half_m = kReach / 2 * std::max({box.extent().x, box.high.y, box.extent().z});
  const Pose T_world_square = compose(ground.T_world_plane, Pose{kUpright, {square_.centre_x, 0, square_.centre_z}});
  const ShadowReceiver receiver{T_world_square, 2 * square_.half_m, 2 * square_.half_m, kEdge, kEdge};
  const auto cast = caster_.cast(light.residual, receiver, {positions, indices, inverse(T_world_square)}, ratios_);
  if (!cast.ok()) return cast.status();
  // Row 0 is at the square's +Y, our -Z: texture coordinates grow with x and z, as rows and columns do.
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB16F, kEdge, kEdge, 0, GL_RGB, GL_FLOAT, ratios_.data());
  positions_ = positions;
  residual_ = light.residual.descriptor().radiance;
  return square_;
}

}  // namespace lightwell::viewer
