// Errors of the light that is found on a rendered glossy plane: directions of lights, three balls.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "measure/specular_truth.hpp"
#include "measure/three_balls.hpp"

namespace lightwell::measure {

/// Of one light of the truth, degrees; 180 where there is none.
struct LightError {
  double relative_irradiance = 0;  ///< Of the light, relative to the strongest one.
  double listed_deg = 180;         ///< Of the nearest light in the descriptor's list.
  /// Of the nearest bright region where the answer is blurred as the truth is.
  double mirrored_deg = 180;
  double sigma_deg = 0;  ///< What the descriptor states for the nearest listed light.
};

struct BallErrors {
  BallError linear, published;  ///< In linear light; by the literature's protocol.
  BallError both_blurred;       ///< As `published`, of the answer blurred as the truth is.
};

/// The balls of this comparison.
inline constexpr std::array kComparedBalls = {Ball::diffuse, Ball::matte_silver, Ball::mirror};

struct LightErrors {
  std::vector<LightError> lights;  ///< As LightTruth::lights.
  std::array<BallErrors, kComparedBalls.size()> balls;
};

/// What surrounds the plane, and the same as a plane of this gloss shows it.
class LightTruth {
 public:
  /// `around`: surroundings(). `alpha`: of the plane.
  LightTruth(const reference::Panorama& around, double alpha);

  [[nodiscard]] const reference::Panorama& around() const { return around_; }
  [[nodiscard]] const std::vector<TrueLight>& lights() const { return lights_; }
  /// Lobe width, rad: farther lights are not the same.
  [[nodiscard]] double lobe_width_rad() const { return width_; }
  /// Of the whole answer: its lights, and its radiance.
  [[nodiscard]] LightErrors errors(const Descriptor& d) const;

 private:
  [[nodiscard]] reference::Panorama blurred(const PanoramaSums& sums) const;

  double roughness_, width_;
  reference::Panorama around_, blurred_;
  std::vector<TrueLight> lights_;
};

/// Null where the descriptor has none. `world`: in the plane's world axes.
[[nodiscard]] const Light* nearest_light(const Descriptor& d, const reference::V3& world);

/// The panorama estimator's answer to an environment in the plane's world axes, in the axes of EnvironmentPicture: what
/// the description alone does.
[[nodiscard]] Descriptor described(const reference::Panorama& environment);

}  // namespace lightwell::measure
