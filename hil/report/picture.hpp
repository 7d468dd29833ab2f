// Draws the result picture of the demo.
#pragma once

#include <string>

#include <lightwell/calibration.hpp>
#include <lightwell/lighting.hpp>

#include "sim/scene.hpp"

namespace lightwell::hil {

/// Writes an 8-bit sRGB PNG: the lens images with the lights marked; below, three balls and a still life lit by the
/// descriptor, and the same lit by the true panorama. `error`: of the descriptor's irradiance, relative. The message of
/// a failure names the file.
[[nodiscard]] Status draw_report(const std::string& path, const std::string& title, const sim::Scene& scene,
                                 const sim::SceneState& state, const RigParameters& rig, const Lighting& lighting,
                                 std::size_t descriptor_bytes, double error);

}  // namespace lightwell::hil
