// What a sensor's channels see of a white of some colour temperature.
#pragma once

#include <array>

namespace lightwell::usb_camera {

/// PhotometricCalibration::white_balance of a camera that shows a black body of this temperature as grey: of Rec. 709
/// red, green and blue what such a light has, by what it has at 6500 K, green being 1. Exactly 1, 1, 1 at 6500 K.
/// 1667 to 25000 K: Kim et al. 2002, US patent 7024034, the cubic splines of the Planckian locus.
[[nodiscard]] std::array<double, 3> white_balance(double kelvin);

}  // namespace lightwell::usb_camera
