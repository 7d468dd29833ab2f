// Constant weights of the basis lights for distant light.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <lightwell/equirect.hpp>
#include <lightwell/relight.hpp>

#include "relight/direction_blend.hpp"
#include "relight/emitter.hpp"
#include "relight/subject.hpp"

namespace lightwell {
namespace relight {
namespace {

/// Adds light from directions to the weights of the basis lights around them.
class WeightSum {
 public:
  static Result<WeightSum> make(std::span<const BasisLight> basis, Vec3d at) {
    if (Status status = validate(basis, {}); !status.ok()) return status;
    if (!is_finite(at) || length(at) > 1e9) return invalid_argument("the subject's point is not finite or above 1e9");
    WeightSum out(basis, at);
    for (std::size_t i = 0; i < basis.size(); ++i) {
      out.arriving_.push_back(incident(basis[i], vec_cast<float>(at)).irradiance);
      const Irradiance& e = out.arriving_.back();
      if (!(e.r > 0 && e.g > 0 && e.b > 0))
        return invalid_argument("basis light " + std::to_string(i) + " has no irradiance in a channel: leave it out");
    }
    return out;
  }

  /// A light in one direction: exact on surfaces that face all of the lights around it.
  void add_light(Vec3d towards, const Irradiance& e) { add(sphere_.blend().at(towards), e); }

  /// A part of light that comes from everywhere: the sum of the weights is 1, so that the mean irradiance over all
  /// normals is exact.
  void add_part(Vec3d towards, const Irradiance& e) {
    auto around = sphere_.blend().at(towards);
    const float sum = around.weight[0] + around.weight[1] + around.weight[2];
    for (float& weight : around.weight) weight /= sum;
    add(around, e);
  }

  std::vector<RgbFactor> take() { return std::move(weights_); }

 private:
  WeightSum(std::span<const BasisLight> basis, Vec3d at) : sphere_(basis, at), weights_(basis.size()) {}

  void add(const DirectionBlend::Weights& around, const Irradiance& e) {
    for (std::size_t k = 0; k < 3; ++k) {
      RgbFactor& weight = weights_[around.light[k]];
      const Irradiance& basis = arriving_[around.light[k]];
      // The residual of harmonics may be negative: light cannot be.
      for (int c = 0; c < 3; ++c)
        if (e[c] > 0) weight[c] += around.weight[k] * e[c] / basis[c];
    }
  }

  BasisSphere sphere_;
  std::vector<Irradiance> arriving_;
  std::vector<RgbFactor> weights_;
};

Irradiance from(const Radiance& radiance, double solid_angle) {
  const auto k = static_cast<float>(solid_angle);
  return {radiance.r * k, radiance.g * k, radiance.b * k};
}

}  // namespace
}  // namespace relight

Result<std::vector<RgbFactor>> basis_weights(const Lighting& lighting, const Pose& T_world_lighting,
                                             std::span<const BasisLight> basis, Vec3d at, int residual_directions) {
  if (lighting.validity() != Validity::valid && lighting.validity() != Validity::stale)
    return Status(
        StatusCode::failed_precondition,
        "the lighting has no values (" + std::string(to_string(lighting.validity())) + "): " + lighting.reason());
  if (residual_directions < 0 || residual_directions > 4096)
    return invalid_argument("residual_directions is " + std::to_string(residual_directions) + ": it must be 0 to 4096");
  const Quat& q = T_world_lighting.rotation;
  if (!is_finite(T_world_lighting.translation) || !(std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) < 1e-6))
    return invalid_argument("T_world_lighting is not finite, or its rotation no unit quaternion");
  auto sum = relight::WeightSum::make(basis, at);
  if (!sum) return sum.status();
  const Vec3d origin = lighting.origin().translation, here = transformed(inverse(T_world_lighting), at);
  for (const Light& light : lighting.lights()) {
    Vec3d towards = vec_cast<double>(light.direction);
    double falloff = 1;
    if (const auto position = lighting.position(light)) {
      towards = *position - here;
      falloff = dot(*position - origin, *position - origin) / dot(towards, towards);
      if (!std::isfinite(falloff))
        return invalid_argument("a light is at the subject's point: drop it or move the point");
    }
    sum->add_light(rotate(q, normalized(towards)), light.irradiance * static_cast<float>(falloff));
  }
  for (int i = 0; i < residual_directions; ++i) {
    const Vec3d towards = fibonacci_direction(i, residual_directions);
    const Radiance radiance = lighting.radiance(vec_cast<float>(towards), 0).value;
    sum->add_part(rotate(q, towards), relight::from(radiance, 4 * std::numbers::pi / residual_directions));
  }
  return sum->take();
}

Result<std::vector<RgbFactor>> basis_weights(std::span<const Radiance> panorama, int columns, int rows,
                                             std::span<const BasisLight> basis, Vec3d at) {
  if (columns < 1 || rows < 1 || columns > 4 * RelightCamera::kMaxSide || rows > 4 * RelightCamera::kMaxSide)
    return invalid_argument("panorama: columns and rows must be 1 to 16384");
  if (Status status = relight::check_size("panorama", panorama.size(),
                                          static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
      !status.ok())
    return status;
  auto sum = relight::WeightSum::make(basis, at);
  if (!sum) return sum.status();
  for (std::size_t p = 0; p < panorama.size(); ++p) {
    const Radiance& radiance = panorama[p];
    if (!std::isfinite(radiance.r + radiance.g + radiance.b) || std::min({radiance.r, radiance.g, radiance.b}) < 0)
      return invalid_argument("panorama: pixel " + std::to_string(p) + " is negative or not finite");
    const int column = static_cast<int>(p % static_cast<std::size_t>(columns));
    const int row = static_cast<int>(p / static_cast<std::size_t>(columns));
    sum->add_part(equirect_direction((column + 0.5) / columns, (row + 0.5) / rows),
                  relight::from(radiance, equirect_solid_angle(row, columns, rows)));
  }
  return sum->take();
}

}  // namespace lightwell
