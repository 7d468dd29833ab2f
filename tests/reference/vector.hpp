// Small vectors, colours and the Fibonacci set of directions, in double.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace lightwell::reference {

inline constexpr double pi = std::numbers::pi;

/// A position in an image, in pixels; (0, 0) is the CENTRE of the first pixel.
struct V2 {
  double x = 0, y = 0;
};

/// A point or direction. Frame: +Y up, -Z forward, unless a name ends in `_cv`
/// (OpenCV: x right, y down, z forward).
struct V3 {
  double x = 0, y = 0, z = 0;
};

inline V3 operator+(const V3& a, const V3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline V3 operator-(const V3& a, const V3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline V3 operator*(double s, const V3& a) { return {s * a.x, s * a.y, s * a.z}; }

inline double dot(const V3& a, const V3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

inline V3 cross(const V3& a, const V3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline double length(const V3& a) { return std::hypot(a.x, a.y, a.z); }

/// a / |a|. The zero vector is returned as it is.
inline V3 normalised(const V3& a) {
  const double n = length(a);
  return n > 0 ? (1.0 / n) * a : a;
}

/// The angle between two vectors of any length, in degrees, 0..180. By atan2 of the cross and the
/// dot product: full precision also near 0 and 180 degrees, where acos has none.
inline double angle_deg(const V3& a, const V3& b) { return std::atan2(length(cross(a, b)), dot(a, b)) * 180.0 / pi; }

/// Radiance (W/sr/m2 or cd/m2) or irradiance (W/m2 or lux): linear, Rec. 709 primaries.
using Rgb = std::array<double, 3>;

inline constexpr Rgb luminance_weights{0.2126, 0.7152, 0.0722};

/// The Rec. 709 luminance of a linear colour, in the colour's own unit.
inline double luminance(const Rgb& c) {
  return luminance_weights[0] * c[0] + luminance_weights[1] * c[1] + luminance_weights[2] * c[2];
}

/// `count` unit vectors evenly distributed over the sphere: bands of equal area along z, each rotated
/// by the golden angle pi (3 - sqrt 5) relative to the previous. Vector i has z = 1 - (2i + 1) / count.
/// The lattice of Gonzalez, "Measurement of areas on a sphere using Fibonacci and
/// latitude-longitude lattices" (2010), with half a step left at either pole.
inline std::vector<V3> fibonacci_normals(int count) {
  const double golden_angle = pi * (3.0 - std::sqrt(5.0));
  std::vector<V3> normals;
  normals.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double ring = std::sqrt((1.0 - z) * (1.0 + z));
    const double azimuth = golden_angle * i;
    normals.push_back({ring * std::cos(azimuth), ring * std::sin(azimuth), z});
  }
  return normals;
}

}  // namespace lightwell::reference
