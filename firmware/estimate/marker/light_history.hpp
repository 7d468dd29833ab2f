// Directions of point lights over several frames. The errors of a light's direction differ from frame to frame: where
// the ground's samples lie relative to the edge of a shadow, which model was selected, the body's attitude.
#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/time.hpp>

#include "estimate/marker/lighting_estimate.hpp"

namespace lightwell::marker {

/// The estimate in axes that are turned by `turn`.
[[nodiscard]] LightingEstimate turned(LightingEstimate estimate, Quat turn);

class LightHistory {
 public:
  /// Replaces the direction of each light by the mean over the frames, weighted by their information, and its
  /// covariance by that of the mean. Frames whose light is another one, by the covariances of both, do not count.
  /// `probe_body`: rotation of T_probe_body.
  void average(ProbeTime time, Quat probe_body, LightingEstimate& estimate);
  void clear() { frames_.clear(); }
  /// Number of frames that are kept: at most 16.
  [[nodiscard]] std::size_t size() const { return frames_.size(); }

 private:
  /// Body axes; covariance in tangent_basis(direction), rad².
  struct Light {
    Vec3d direction;
    std::array<double, 3> covariance{};
  };
  struct Frame {
    ProbeTime time;
    std::vector<Light> lights;
  };

  std::deque<Frame> frames_;  // oldest first; the last is the current one
};

}  // namespace lightwell::marker
