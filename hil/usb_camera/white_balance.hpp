// White balance of the sensor's channels for a colour temperature.
#pragma once

#include <array>

namespace lightwell::usb_camera {

/// PhotometricCalibration::white_balance of a camera that renders a black body of this temperature as grey: the black
/// body's linear Rec. 709 red, green and blue relative to those of a black body of 6500 K, normalized to green 1;
/// exactly 1, 1, 1 at 6500 K. Valid from 1667 to 25000 K: cubic splines of the Planckian locus, Kim et al. 2002, US
/// patent 7024034.
[[nodiscard]] std::array<double, 3> white_balance(double kelvin);

}  // namespace lightwell::usb_camera
