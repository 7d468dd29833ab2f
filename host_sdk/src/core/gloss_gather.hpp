// Sums over a tree of surfels under the gloss lobe of a plane.
#pragma once

#include <array>
#include <span>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/specular_brdf.hpp>

#include "core/mirror_image.hpp"

namespace lightwell::core {

class GlossGather {
 public:
  /// Computes the albedo again if the BRDF changed; about 1 ms.
  void set(const SpecularBrdf& brdf);

  [[nodiscard]] const SpecularBrdf& brdf() const { return brdf_; }

  /// The integral of f(v, l) n·l over the hemisphere of l, 0 to 1: what the lobe reflects of uniform radiance 1.
  /// `cosine`: n·v, 0 to 1.
  [[nodiscard]] float albedo(float cosine) const;

  struct Sum {
    Radiance reflected;  ///< The integral of f n·l L over what the tree covers.
    float hidden = 0;    ///< The same for L = 1, divided by the albedo; 0 to 1.
  };
  /// At the point (x, y) of the plane towards the unit vector v, v.z > 0. `groups`: as MirrorImage. `tolerance`: as
  /// ReflectionOptions.
  [[nodiscard]] Sum gather(std::span<const SurfelGroup> groups, float x, float y, Vec3f v, float tolerance) const;

 private:
  static constexpr int kSteps = 64;

  SpecularBrdf brdf_{0, -1};
  std::array<float, kSteps + 1> albedo_{};  ///< At cosines (k / kSteps)².
};

}  // namespace lightwell::core
