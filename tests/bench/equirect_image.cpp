#include "bench/equirect_image.hpp"

#include <chrono>
#include <cmath>
#include <numbers>

namespace lightwell::bench {

namespace {
constexpr double kPi = std::numbers::pi;
}

Triple equirect_direction(double x, double y, int width, int height) {
  const double phi = 2 * kPi * (x / width - 0.5), theta = kPi * (0.5 - y / height);
  return {std::cos(theta) * std::sin(phi), std::sin(theta), -std::cos(theta) * std::cos(phi)};
}

double equirect_solid_angle(int j, int width, int height) {
  // The difference of two sines is computed as a product, which loses no digits at the poles.
  return 2 * kPi / width * 2 * std::sin(kPi * (j + 0.5) / height) * std::sin(0.5 * kPi / height);
}

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace lightwell::bench
