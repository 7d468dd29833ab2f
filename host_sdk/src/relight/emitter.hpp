// Light that arrives at a point of the subject from basis lights and patterns.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/relight.hpp>
#include <lightwell/result.hpp>

#include "relight/subject.hpp"

namespace lightwell::relight {

/// Light at a point from one place, without occlusion.
struct Incident {
  Vec3f towards;          ///< Unit; zero at the light itself.
  float distance = 0;     ///< m; infinite for a distant light.
  Irradiance irradiance;  ///< At normal incidence.
};

/// Nearer than this, irradiance does not grow any more.
inline constexpr float kMinDistance_m = 1e-3F;

[[nodiscard]] Incident incident(const BasisLight& light, Vec3f at);

/// invalid_argument, naming the member.
[[nodiscard]] Status validate(const BasisLight& light, const std::string& name);
[[nodiscard]] Status validate(const PatternLight& light, const std::string& name);
/// All lights of a call; resource_exhausted for too many.
[[nodiscard]] Status validate(std::span<const BasisLight> basis, std::span<const PatternLight> patterns);

/// A pattern's picture with levels of half the size each (Williams 1983), and its projection.
class PatternSampler {
 public:
  /// `light` must validate.
  explicit PatternSampler(const PatternLight& light);

  [[nodiscard]] Vec3f position() const { return position_; }
  /// Light at a pixel: the mean of the picture over what the pixel covers of it. Black outside of the picture.
  [[nodiscard]] Incident at_pixel(const SubjectData& subject, std::size_t pixel) const;
  /// Light at a point; `width` m across are averaged.
  [[nodiscard]] Incident at_point(Vec3f point, float width) const;

 private:
  struct Level {
    int columns = 0, rows = 0;
    std::vector<RgbFactor> texels;
  };
  /// Texels of level 0, from the picture's corner; z: distance along the axis, at most 0 behind the light.
  [[nodiscard]] Vec3f project(Vec3f point) const;
  [[nodiscard]] RgbFactor bilinear(float x, float y, std::size_t level) const;
  [[nodiscard]] Incident incident(Vec3f point, RgbFactor transmittance) const;
  [[nodiscard]] std::size_t level_of(float texels) const;

  std::vector<Level> levels_;
  Vec3f position_, right_, up_, back_;  ///< Axes of the light in the world.
  float scale_ = 0;                     ///< Texels per tangent.
  Irradiance irradiance_;
};

}  // namespace lightwell::relight
