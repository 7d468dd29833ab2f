// Ready-made rigs: the lenses and sensors that the simulated camera can have.
#pragma once

#include <array>
#include <string_view>

#include <lightwell/calibration.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "sim/sensor.hpp"

namespace lightwell::sim {

inline constexpr std::array<std::string_view, 4> kRigKinds = {"pair", "single", "double_sphere", "equirect"};

/// A rig of a kind, each lens with a picture of width x height:
///   pair           two Kannala-Brandt lenses of 190 degrees back to back; lens 0 looks along the
///                  probe's -Z, lens 1 along +Z, both pictures upright: +X is right in the first,
///                  left in the second
///   single         lens 0 of the pair alone
///   double_sphere  the pair with double sphere lenses
///   equirect       the whole sphere in one picture; height must be width / 2
/// The whole circle of a lens lies inside the picture with 1 % to spare. Both lenses stand in the
/// probe's origin: a panorama is infinitely far away.
///
/// Photometry by format:
///   rgb_f32            ideal; relative units, which are the panorama's
///   rgb8, nv12, yuyv   sRGB, mild vignetting, small CMOS noise: 10,000 electrons, 3 read
///   bayer10, bayer12   the same, linear with a black level
/// All but the first are absolute: one unit of the panorama reads one cd/m².
///
/// invalid_argument: an unknown kind, with the nearest one; a size that kind or format cannot have.
[[nodiscard]] Result<RigParameters> make_rig(std::string_view kind, int width, int height, PixelFormat format);

/// The sensor that a rig's calibration describes.
[[nodiscard]] SensorModel sensor_of(const RigParameters& rig, PixelFormat format, std::uint64_t seed);

/// The exposure that puts `radiance` 5 % below saturation on the axis at this gain. 1 for rgb_f32,
/// which has no ceiling.
[[nodiscard]] double exposure_below_saturation(const SensorModel& sensor, double radiance, double gain);

}  // namespace lightwell::sim
