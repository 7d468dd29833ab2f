// Predefined rigs: the lenses and sensors of the simulated camera.
#pragma once

#include <array>
#include <string_view>

#include <lightwell/calibration.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "sim/sensor.hpp"

namespace lightwell::sim {

inline constexpr std::array<std::string_view, 4> kRigKinds = {"pair", "single", "double_sphere", "equirect"};

/// A rig of the given kind; the picture of each lens is width x height:
///   pair           two Kannala-Brandt lenses of 190 degrees back to back; lens 0 looks along the
///                  probe's -Z, lens 1 along +Z, both pictures upright: +X is right in the first,
///                  left in the second
///   single         only lens 0 of the pair
///   double_sphere  the pair with double sphere lenses
///   equirect       the whole sphere in one picture; height must be width / 2
/// The image circle of a lens lies inside the picture with a margin of 1 %. Both lenses are at the probe's origin,
/// because a panorama is infinitely distant.
///
/// Photometry by format:
///   rgb_f32            ideal; relative units, those of the panorama
///   rgb8, nv12, yuyv   sRGB, mild vignetting, small CMOS noise: 10,000 electrons, 3 read
///   bayer10, bayer12   the same, linear with a black level
/// All except the first are absolute: one unit of the panorama is one cd/m².
///
/// invalid_argument for an unknown kind, with the nearest known one, and for a size that kind or format does not allow.
[[nodiscard]] Result<RigParameters> make_rig(std::string_view kind, int width, int height, PixelFormat format);

/// The sensor that a rig's calibration describes.
[[nodiscard]] SensorModel sensor_of(const RigParameters& rig, PixelFormat format, std::uint64_t seed);

/// The exposure, s, at which `radiance` on the axis is 5 % below saturation at this gain. 1 for rgb_f32, which does not
/// saturate.
[[nodiscard]] double exposure_below_saturation(const SensorModel& sensor, double radiance, double gain);

}  // namespace lightwell::sim
