// The lighting part of the sample: what an application passes to its renderer each frame.
#pragma once

#include <optional>
#include <ostream>

#include <lightwell/conventions.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>

namespace openxr_light {

/// The lighting in an XrSpace S, in the form of XR_ANDROID_light_estimation.
///   lighting        of the probe, in the probe's axes
///   T_world_probe   pose of the probe in the world (STAGE or LOCAL): a measured mounting, or from a tag on the probe
///                   that the headset detects
///   T_world_space   pose of S in the world, from xrLocateSpace(S, world); the identity for the world itself
[[nodiscard]] lightwell::Converted<lightwell::OpenXrLightEstimate> light_in_space(
    const lightwell::Lighting& lighting, const lightwell::Pose& T_world_probe, const lightwell::Pose& T_world_space,
    lightwell::XrSphericalHarmonicsKind kind);

/// Prints an estimate in lines that start with `indent`.
void print(std::ostream& out, const lightwell::Converted<lightwell::OpenXrLightEstimate>& estimate, const char* indent);

}  // namespace openxr_light
