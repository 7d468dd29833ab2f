// Constant weights of the basis lights for distant light.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
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

/// PlaceLights: in radii of the subject, the least distance of a pattern and the largest.
constexpr double kNearestRadii = 1.2, kDistantRadii = 100;
/// A white picture. Towards its edge it is filtered with the black outside; the subject has the middle half.
constexpr int kWhiteTexels = 4;
constexpr std::array<RgbFactor, std::size_t{kWhiteTexels}* kWhiteTexels> kWhite = [] {
  std::array<RgbFactor, std::size_t{kWhiteTexels} * kWhiteTexels> out{};
  out.fill({1, 1, 1});
  return out;
}();

/// A light that shines on the ball of `radius` around `centre`, from outside of it.
PatternLight white_pattern(Vec3d position, Vec3d centre, double radius, const Irradiance& intensity) {
  const Vec3d to_light = position - centre;
  const double sine = radius / length(to_light);
  PatternLight out;
  out.T_world_light = {rotation_between({0, 0, 1}, normalized(to_light)), position};
  out.field_of_view_rad = 2 * std::atan(2 * sine / std::sqrt(1 - sine * sine));
  out.columns = out.rows = kWhiteTexels;
  out.picture = kWhite;
  out.irradiance = intensity;
  return out;
}

/// basis_weights() without the lights of known distance that `takes` takes: its arguments are the light's index, its
/// position in the world, m, and its irradiance 1 m away.
template <class Takes>
Result<std::vector<RgbFactor>> weights_of(const Lighting& lighting, const Pose& T_world_lighting,
                                          std::span<const BasisLight> basis, Vec3d at, int residual_directions,
                                          const Takes& takes) {
  if (lighting.validity() != Validity::valid && lighting.validity() != Validity::stale)
    return Status(
        StatusCode::failed_precondition,
        "the lighting has no values (" + std::string(to_string(lighting.validity())) + "): " + lighting.reason());
  if (residual_directions < 0 || residual_directions > 4096)
    return invalid_argument("residual_directions is " + std::to_string(residual_directions) + ": it must be 0 to 4096");
  const Quat& q = T_world_lighting.rotation;
  if (!is_finite(T_world_lighting.translation) || !(std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) < 1e-6))
    return invalid_argument("T_world_lighting is not finite, or its rotation no unit quaternion");
  auto sum = WeightSum::make(basis, at);
  if (!sum) return sum.status();
  const Vec3d origin = lighting.origin().translation, here = transformed(inverse(T_world_lighting), at);
  for (std::size_t number = 0; number < lighting.lights().size(); ++number) {
    const Light& light = lighting.lights()[number];
    Vec3d towards = vec_cast<double>(light.direction);
    double falloff = 1;
    if (const auto position = lighting.position(light)) {
      const double squared = dot(*position - origin, *position - origin);
      if (takes(number, transformed(T_world_lighting, *position), light.irradiance * static_cast<float>(squared)))
        continue;
      towards = *position - here;
      falloff = squared / dot(towards, towards);
      if (!std::isfinite(falloff))
        return invalid_argument("a light is at the subject's point: drop it or move the point");
    }
    sum->add_light(rotate(q, normalized(towards)), light.irradiance * static_cast<float>(falloff));
  }
  for (int i = 0; i < residual_directions; ++i) {
    const Vec3d towards = fibonacci_direction(i, residual_directions);
    const Radiance radiance = lighting.radiance(vec_cast<float>(towards), 0).value;
    sum->add_part(rotate(q, towards), from(radiance, 4 * std::numbers::pi / residual_directions));
  }
  return sum->take();
}

}  // namespace
}  // namespace relight

Result<std::vector<RgbFactor>> basis_weights(const Lighting& lighting, const Pose& T_world_lighting,
                                             std::span<const BasisLight> basis, Vec3d at, int residual_directions) {
  return relight::weights_of(lighting, T_world_lighting, basis, at, residual_directions,
                             [](std::size_t, Vec3d, const Irradiance&) { return false; });
}

Result<PlaceLights> place_lights(const Lighting& lighting, const Pose& T_world_lighting,
                                 std::span<const BasisLight> basis, const RelightSubject& subject,
                                 int residual_directions) {
  const relight::SubjectData& data = subject.data();
  if (data.without_geometry == data.depth.size()) return invalid_argument("the subject has no geometry");
  double radius = 0;
  for (std::size_t pixel = 0; pixel < data.depth.size(); ++pixel)
    if (data.has_geometry(pixel))
      radius = std::max(radius, length(vec_cast<double>(data.positions[pixel]) - data.centre));
  PlaceLights out;
  auto weights = relight::weights_of(
      lighting, T_world_lighting, basis, data.centre, residual_directions,
      [&](std::size_t light, Vec3d position, const Irradiance& intensity) {
        const double distance = length(position - data.centre);
        if (distance > relight::kDistantRadii * radius) return false;
        if (distance < relight::kNearestRadii * radius || out.patterns.size() == AlphaMaps::kMaxPatterns) {
          out.left_in_weights.push_back(light);
          return false;
        }
        out.patterns.push_back(relight::white_pattern(position, data.centre, radius, intensity));
        return true;
      });
  if (!weights) return weights.status();
  out.weights = std::move(*weights);
  return out;
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
