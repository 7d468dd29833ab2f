#include "usb_camera/white_balance.hpp"

#include "usb_camera/controls.hpp"

namespace lightwell::usb_camera {

namespace {

double cubic(double t, double a, double b, double c, double d) { return ((a * t + b) * t + c) * t + d; }

/// Linear Rec. 709 of the black body with Y = 1.
std::array<double, 3> planckian_rgb(double kelvin) {
  const double t = 1000 / kelvin;
  const double x = kelvin <= 4000 ? cubic(t, -0.2661239, -0.2343589, 0.8776956, 0.179910)
                                  : cubic(t, -3.0258469, 2.1070379, 0.2226347, 0.240390);
  const double y = kelvin <= 2222   ? cubic(x, -1.1063814, -1.34811020, 2.18555832, -0.20219683)
                   : kelvin <= 4000 ? cubic(x, -0.9549476, -1.37418593, 2.09137015, -0.16748867)
                                    : cubic(x, 3.0817580, -5.87338670, 3.75112997, -0.37001483);
  const double big_x = x / y, big_z = (1 - x - y) / y;
  // IEC 61966-2-1, annex F: XYZ to linear sRGB.
  return {3.2406 * big_x - 1.5372 - 0.4986 * big_z, -0.9689 * big_x + 1.8758 + 0.0415 * big_z,
          0.0557 * big_x - 0.2040 + 1.0570 * big_z};
}

}  // namespace

std::array<double, 3> white_balance(double kelvin) {
  const std::array<double, 3> seen = planckian_rgb(kelvin), neutral = planckian_rgb(kNeutralKelvin);
  const double green = seen[1] / neutral[1];
  return {seen[0] / neutral[0] / green, 1.0, seen[2] / neutral[2] / green};
}

}  // namespace lightwell::usb_camera
