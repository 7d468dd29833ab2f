// Projections of other programs, implemented from their documentation, independent of the code under test.
// Axes: x right, y down, z forward; (0, 0) is the centre of the top left pixel.
#pragma once

#include <array>
#include <cmath>
#include <functional>

namespace lightwell::test {

using Pixel = std::array<double, 2>;
using Formula = std::function<Pixel(double x, double y, double z)>;

/// docs.opencv.org, "Fisheye camera model": theta_d = theta (1 + k1 theta² + k2 theta⁴ + k3 theta⁶ + k4 theta⁸), x' and
/// y' its components along a and b. theta is the angle from the axis; OpenCV's atan(a/z) is limited to 90 degrees.
inline Formula fisheye(double fx, double fy, double cx, double cy, std::array<double, 4> k) {
  return [=](double x, double y, double z) -> Pixel {
    const double theta = std::acos(z / std::sqrt(x * x + y * y + z * z)), azimuth = std::atan2(y, x);
    const double theta_d = theta + k[0] * std::pow(theta, 3) + k[1] * std::pow(theta, 5) + k[2] * std::pow(theta, 7) +
                           k[3] * std::pow(theta, 9);
    return {fx * theta_d * std::cos(azimuth) + cx, fy * theta_d * std::sin(azimuth) + cy};
  };
}

/// Kalibr's wiki, "Supported models", ds: [xi alpha fu fv pu pv]; Usenko et al. 2018, eq. 40 to 42.
inline Formula double_sphere(double xi, double alpha, double fu, double fv, double pu, double pv) {
  return [=](double x, double y, double z) -> Pixel {
    const double d1 = std::sqrt(x * x + y * y + z * z);
    const double d2 = std::sqrt(x * x + y * y + (xi * d1 + z) * (xi * d1 + z));
    const double below = alpha * d2 + (1 - alpha) * (xi * d1 + z);
    return {fu * x / below + pu, fv * y / below + pv};
  };
}

/// omnidir.hpp and Mei & Rives 2007, section II: projection onto the unit sphere, then from a point xi above its
/// centre, distortion with D = (k1, k2, p1, p2), then K. Kalibr's omni: [xi fu fv pu pv] with radtan [k1 k2 r1 r2].
inline Formula omni(double xi, double fu, double fv, double pu, double pv, std::array<double, 4> d) {
  return [=](double x, double y, double z) -> Pixel {
    const double length = std::sqrt(x * x + y * y + z * z);
    const double u = (x / length) / (z / length + xi), v = (y / length) / (z / length + xi);
    const double r2 = u * u + v * v, radial = 1 + d[0] * r2 + d[1] * r2 * r2;
    const double u_d = u * radial + 2 * d[2] * u * v + d[3] * (r2 + 2 * u * u);
    const double v_d = v * radial + d[2] * (r2 + 2 * v * v) + 2 * d[3] * u * v;
    return {fu * u_d + pu, fv * v_d + pv};
  };
}

/// docs.opencv.org, calib3d: x' = x/z, y' = y/z, distorted by k1 k2 p1 p2.
inline Formula pinhole(double fx, double fy, double cx, double cy, std::array<double, 4> d) {
  return [=](double x, double y, double z) -> Pixel {
    const double a = x / z, b = y / z, r2 = a * a + b * b, radial = 1 + r2 * (d[0] + r2 * d[1]);
    return {fx * (a * radial + 2 * d[2] * a * b + d[3] * (r2 + 2 * a * a)) + cx,
            fy * (b * radial + d[2] * (r2 + 2 * b * b) + 2 * d[3] * a * b) + cy};
  };
}

}  // namespace lightwell::test
