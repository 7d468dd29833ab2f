// Follows point lights through the frames of one body: when lights are searched instead of tracked, and what earlier
// frames say about their directions.
#pragma once

#include <optional>

#include <lightwell/geometry.hpp>
#include <lightwell/time.hpp>

#include "estimate/marker/light_history.hpp"
#include "estimate/marker/lighting_estimate.hpp"
#include "estimate/marker/shading.hpp"
#include "estimate/marker/shading_change.hpp"

namespace lightwell::marker {

/// Where a frame shows the body.
struct BodyView {
  ProbeTime time;
  Quat probe_body;         ///< Rotation of T_probe_body.
  Vec3d to_lens;           ///< From the body's centre to the lens, probe frame.
  bool ambiguous = false;  ///< Another attitude explains the frame nearly as well.
};

class LightFollower {
 public:
  /// The lights of a frame. They are tracked from the last frame (estimate_lighting()), or searched where
  /// - the light has changed (ShadingChange), at once, but at most every 0.25 s for light that changes all the time, or
  /// - the lens has moved by 5 degrees around the body since the last search, 0.25 s ago or more, or
  /// - 0.5 s, then 1 s, 2 s, ... at most 8 s have passed: the first frame may have misled the selection of the lights.
  /// Directions are means over the frames since the light has changed last (LightHistory); an ambiguous
  /// attitude is no part of them. A time before the last one is a first frame.
  [[nodiscard]] LightingEstimate estimate(const BodyView& view, const Shading& shading, int max_lights);
  /// The next frame is a first one: the body was lost, or the unit of radiance has changed.
  void reset();

 private:
  [[nodiscard]] bool search_is_due(const BodyView& view, Vec3d direction) const;

  struct Before {
    LightingEstimate light;  ///< Of the frame alone.
    ProbeTime time;
    Quat probe_body;
  };
  std::optional<Before> before_;
  ShadingChange change_;
  LightHistory history_;
  ProbeTime searched_;           // last search
  Vec3d searched_from_;          // direction from the body's centre to the lens then, body axes
  bool change_pending_ = false;  // the light has changed, and was not searched since
  std::optional<ProbeTime> change_searched_;
  double interval_s_ = 0;  // until the next search
};

}  // namespace lightwell::marker
