// Scene files of ar_viewer (host_sdk/tools/ar_viewer/README.md) for the path-traced trials: the virtual object in the
// place of the real one, lit in several ways.
//   constant             the mean radiance of the panorama, no shadow
//   s0                   Algorithm 1 of CubeMap360 (bench/alhakamy2019.hpp) on an 8-bit picture of the panorama: a
//   point
//                        light towards the largest contour, and uniform ambient light. The document gives no
//                        photometry: the light's share of the table's irradiance is its shadow strength, and the
//                        table's irradiance, all colours included, that of the descriptor.
//   main_light_and_sh9   the descriptor's strongest light as a point, all else in nine coefficients
//   full                 the descriptor
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/lighting.hpp>
#include <lightwell/result.hpp>

#include "measure/viewer_trials.hpp"

namespace lightwell::measure {

inline constexpr std::array<std::string_view, 4> kViewerMethods = {"constant", "s0", "main_light_and_sh9", "full"};

struct ViewerScene {
  const TrialSetup& setup;
  const ViewerTrial& trial;
  std::string place;  ///< Of the probe.
  Pose T_world_probe;
  const Lighting& light;               ///< In the probe's frame.
  std::span<const std::byte> message;  ///< The encoded descriptor.
  const ColorPicture& panorama;
};

/// FOLDER/TRIAL_PLACE_METHOD, without an extension.
[[nodiscard]] std::string viewer_scene_name(const std::string& folder, const ViewerTrial& trial,
                                            const std::string& place, std::string_view method);

/// Writes a scene for each method, and the descriptor.
[[nodiscard]] Status write_viewer_scenes(const ViewerScene& scene, const std::string& folder);

/// FOLDER/turning.lwrec: descriptors of a light that turns about +Y by 0.1 degrees in each, 16 ms apart, each with
/// another map. To measure what a frame costs where all of the light changes in each.
[[nodiscard]] Status write_turning_light(Descriptor descriptor, int frames, const std::string& folder);

}  // namespace lightwell::measure
