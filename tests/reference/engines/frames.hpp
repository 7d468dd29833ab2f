// The right, up and forward axes of each engine.
#pragma once

#include "reference/vector.hpp"

namespace lightwell::reference::engines {

struct Frame {
  V3 right, up, forward;
};

/// Right-handed, +Y up, -Z forward.
/// OpenXR specification, 2.16 "Coordinate System" ("+X to the right, +Y up, and -Z forward").
/// WebXR Device API, 7 "Geometric Primitives" ("right-handed coordinate system", -Z forward).
/// ARCore, "Poses and coordinate spaces" (arcore_c_api.h): "right-handed, like OpenGL conventions"; +Y up.
/// ARKit, ARConfiguration.WorldAlignment: right-handed, y-axis points up.
/// three.js manual, "Fundamentals": right-handed, +Y up. Filament, "Filament.md.html", 8.1: right-handed, +Y up.
inline constexpr Frame y_up_right_handed{{1, 0, 0}, {0, 1, 0}, {0, 0, -1}};

/// Unity manual, "Rotation and orientation in Unity": left-handed, y up; Vector3.right, up, forward = x, y, z.
inline constexpr Frame unity_frame{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

/// Unreal Engine, "Coordinate System and Spaces": left-handed, FVector::ForwardVector = X, RightVector = Y,
/// UpVector = Z.
inline constexpr Frame unreal_frame{{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};

/// The vector with these components to the right, up and forward, in the engine's axes.
inline V3 in_frame(const Frame& f, double right, double up, double forward) {
  return right * f.right + up * f.up + forward * f.forward;
}

}  // namespace lightwell::reference::engines
