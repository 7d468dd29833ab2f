// What is true of a real panorama, independent of production: its irradiance, its brightest region, and the sums
// from which its balls are lit (three_balls.hpp).
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

/// An answer to "how is this normal lit": irradiance, not divided by pi, in the panorama's unit and frame.
using IrradianceAnswer = std::function<reference::Rgb(const reference::V3& unit_normal)>;

/// The 2,048 Fibonacci normals of proto/README.md's error of irradiance.
[[nodiscard]] const std::vector<reference::V3>& truth_normals();

struct PanoramaTruth {
  std::string name;   ///< The file's, without folder and ending.
  PanoramaSums sums;  ///< And the panorama, cleaned: NaN and negative numbers are 0 (proto/README.md).
  std::vector<reference::Rgb> irradiance;            ///< At truth_normals().
  std::optional<reference::BrightRegion> brightest;  ///< None where it is black.
};

/// Of radiance that need not be clean. 0.3 s at 1024x512, 0.06 s at 512x256.
[[nodiscard]] PanoramaTruth panorama_truth(std::string name, const reference::Panorama& panorama);

/// Of an OpenEXR or Radiance file. The errors of read_image; invalid_argument for 8-bit pictures and where the
/// width is not twice the height.
[[nodiscard]] Result<PanoramaTruth> load_panorama_truth(const std::string& path);

/// proto/README.md's error of irradiance of an answer, and its relatives.
[[nodiscard]] reference::IrradianceError irradiance_error(const PanoramaTruth& truth, const IrradianceAnswer& answer);

/// The paths of the eight panoramas of `cmake/fetch_panoramas`, and of those with the eighteen of its `--all`, by
/// name; in $LIGHTWELL_PANORAMA_DIR or the cache. not_found, with the command to run, where one is not there.
[[nodiscard]] Result<std::vector<std::string>> eight_panoramas();
[[nodiscard]] Result<std::vector<std::string>> all_panoramas();

}  // namespace lightwell::measure
