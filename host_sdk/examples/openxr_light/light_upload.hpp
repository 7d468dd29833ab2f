// The light half of the sample: what an application hands to its renderer each frame.
#pragma once

#include <optional>
#include <ostream>

#include <lightwell/conventions.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>

namespace openxr_light {

/// The light in an XrSpace S, as XR_ANDROID_light_estimation would give it there.
///   lighting        of the probe, in the probe's axes
///   T_world_probe   where the probe is in the world (STAGE or LOCAL): a mounting that was measured, or a tag on the
///   probe
///                   that the headset sees
///   T_world_space   where S is in the world, from xrLocateSpace(S, world); the identity for the world itself
[[nodiscard]] lightwell::Converted<lightwell::OpenXrLightEstimate> light_in_space(
    const lightwell::Lighting& lighting, const lightwell::Pose& T_world_probe, const lightwell::Pose& T_world_space,
    lightwell::XrSphericalHarmonicsKind kind);

/// One estimate in lines that start with `indent`.
void print(std::ostream& out, const lightwell::Converted<lightwell::OpenXrLightEstimate>& estimate, const char* indent);

}  // namespace openxr_light
