// Ground truth of a real panorama, independent of production code: irradiance, brightest region, and the sums that
// light its balls (three_balls.hpp).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "measure/panorama_sums.hpp"
#include "reference/bright_region.hpp"
#include "reference/irradiance.hpp"

namespace lightwell::measure {

/// An estimate of irradiance for a normal, not divided by pi, in the panorama's unit and frame.
using IrradianceAnswer = std::function<reference::Rgb(const reference::V3& unit_normal)>;

/// The 2,048 normals (Fibonacci lattice) of proto/README.md's error of irradiance.
[[nodiscard]] const std::vector<reference::V3>& truth_normals();

struct PanoramaTruth {
  std::string name;   ///< File name without folder and extension.
  PanoramaSums sums;  ///< Includes the cleaned panorama: NaN and negative values are 0 (proto/README.md).
  std::vector<reference::Rgb> irradiance;            ///< At truth_normals().
  std::optional<reference::BrightRegion> brightest;  ///< None for a black panorama.
};

/// Computes the truth of a panorama, which is cleaned first. 0.3 s at 1024x512, 0.06 s at 512x256.
[[nodiscard]] PanoramaTruth panorama_truth(std::string name, const reference::Panorama& panorama);

/// Reads an OpenEXR or Radiance file. Errors of read_image; invalid_argument for 8-bit images and if the width is not
/// twice the height.
[[nodiscard]] Result<PanoramaTruth> load_panorama_truth(const std::string& path);

/// Error of irradiance of an estimate as defined in proto/README.md, with its variants.
[[nodiscard]] reference::IrradianceError irradiance_error(const PanoramaTruth& truth, const IrradianceAnswer& answer);

/// Paths, sorted by name, of the eight panoramas of `cmake/fetch_panoramas`, and of these and the eighteen of its
/// `--all`; in $LIGHTWELL_PANORAMA_DIR or the cache. not_found, with the command to run, if one is missing.
[[nodiscard]] Result<std::vector<std::string>> eight_panoramas();
[[nodiscard]] Result<std::vector<std::string>> all_panoramas();

}  // namespace lightwell::measure
