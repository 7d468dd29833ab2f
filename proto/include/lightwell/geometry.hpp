// Vectors, rotations and poses. World and probe frames: right-handed, +Y up, -Z forward, metres.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace lightwell {

template <class T>
struct Vec3 {
  T x{}, y{}, z{};

  friend constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vec3 operator*(Vec3 a, T s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3 operator*(T s, Vec3 a) { return a * s; }
  constexpr Vec3& operator+=(Vec3 o) { return *this = *this + o; }
  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
};

using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;

template <class T>
[[nodiscard]] constexpr T dot(Vec3<T> a, Vec3<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class T>
[[nodiscard]] constexpr Vec3<T> cross(Vec3<T> a, Vec3<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class T>
[[nodiscard]] T length(Vec3<T> a) {
  return std::sqrt(dot(a, a));
}

template <class T>
[[nodiscard]] bool is_finite(Vec3<T> a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

/// The unit vector along `a`; zero for zero, NaN or infinite input, so that non-finite values do not propagate.
template <class T>
[[nodiscard]] Vec3<T> normalized(Vec3<T> a) {
  // Scaled first: squares of tiny or huge components would leave the type's range.
  const T largest = std::max({std::abs(a.x), std::abs(a.y), std::abs(a.z)});
  if (!(largest > T(0)) || !std::isfinite(a.x + a.y + a.z)) return {};
  const Vec3<T> scaled{a.x / largest, a.y / largest, a.z / largest};
  return scaled * (T(1) / length(scaled));
}

/// Angle between two vectors of any length, rad, 0 to pi. Accurate also near 0 and near pi, unlike acos of the dot
/// product.
template <class T>
[[nodiscard]] T angle_between(Vec3<T> a, Vec3<T> b) {
  return std::atan2(length(cross(a, b)), dot(a, b));
}

template <class To, class From>
[[nodiscard]] constexpr Vec3<To> vec_cast(Vec3<From> a) {
  return {static_cast<To>(a.x), static_cast<To>(a.y), static_cast<To>(a.z)};
}

/// Two unit vectors u, v that form a right-handed orthonormal frame (u, v, n) with the unit vector n.
/// Duff et al. 2017, "Building an Orthonormal Basis, Revisited", listing 3. Direction covariances are stated in it.
template <class T>
[[nodiscard]] std::array<Vec3<T>, 2> tangent_basis(Vec3<T> n) {
  const T sign = std::copysign(T(1), n.z);
  const T a = T(-1) / (sign + n.z);
  const T b = n.x * n.y * a;
  return {Vec3<T>{T(1) + sign * n.x * n.x * a, sign * b, -sign * n.x}, Vec3<T>{b, sign + n.y * n.y * a, -n.y}};
}

/// Rotation quaternion, Hamilton convention, order x, y, z, w.
struct Quat {
  double x = 0, y = 0, z = 0, w = 1;

  /// Right-handed rotation about a unit axis.
  [[nodiscard]] static Quat about(Vec3d axis, double angle_rad) {
    const double s = std::sin(angle_rad / 2);
    return {axis.x * s, axis.y * s, axis.z * s, std::cos(angle_rad / 2)};
  }

  friend constexpr bool operator==(const Quat&, const Quat&) = default;

  [[nodiscard]] constexpr Quat inverse() const { return {-x, -y, -z, w}; }

  /// Scaled to unit length; the identity if the length is zero or not finite.
  [[nodiscard]] Quat normalized() const {
    const double n = std::sqrt(x * x + y * y + z * z + w * w);
    if (!(n > 0) || !std::isfinite(n)) return {};
    return {x / n, y / n, z / n, w / n};
  }

  /// Hamilton product: the rotation by b followed by the rotation by a.
  friend constexpr Quat operator*(Quat a, Quat b) {
    return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
  }
};

/// v rotated by the unit quaternion q.
template <class T>
[[nodiscard]] constexpr Vec3<T> rotate(Quat q, Vec3<T> v) {
  const Vec3d u{q.x, q.y, q.z};
  const Vec3d p = vec_cast<double>(v);
  const Vec3d t = cross(u, p) * 2.0;
  return vec_cast<T>(p + t * q.w + cross(u, t));
}

/// The smallest rotation that turns the unit vector `from` to the unit vector `to`; of opposite ones, half a turn about
/// any axis across.
[[nodiscard]] inline Quat rotation_between(Vec3d from, Vec3d to) {
  if (dot(from, to) < -1 + 1e-12) {
    const Vec3d any = tangent_basis(from)[0];
    return {any.x, any.y, any.z, 0};
  }
  const Vec3d axis = cross(from, to);
  return Quat{axis.x, axis.y, axis.z, 1 + dot(from, to)}.normalized();
}

/// Rigid transform T_a_b: maps points of frame b into frame a, p_a = rotation p_b + translation (m).
struct Pose {
  Quat rotation;
  Vec3d translation;

  friend constexpr bool operator==(const Pose&, const Pose&) = default;
};

/// Maps the point p from frame b into frame a. Here and below rotations must be unit quaternions.
[[nodiscard]] constexpr Vec3d transformed(const Pose& a_b, Vec3d p) {
  return rotate(a_b.rotation, p) + a_b.translation;
}

/// T_a_c = T_a_b T_b_c.
[[nodiscard]] constexpr Pose compose(const Pose& a_b, const Pose& b_c) {
  return {a_b.rotation * b_c.rotation, transformed(a_b, b_c.translation)};
}

/// T_b_a.
[[nodiscard]] constexpr Pose inverse(const Pose& a_b) {
  const Quat back = a_b.rotation.inverse();
  return {back, -rotate(back, a_b.translation)};
}

/// Unit vector i of `count` on a spiral from +Z to -Z, each representing 4 pi / count sr: the rings have equal area,
/// and each is rotated by the golden angle relative to the previous one. The Fibonacci lattice of Gonzalez 2010,
/// "Measurement of areas on a sphere using Fibonacci and latitude-longitude lattices", with half a step at the poles.
[[nodiscard]] inline Vec3d fibonacci_direction(int i, int count) {
  const double z = 1 - (2.0 * i + 1) / count, ring = std::sqrt((1 - z) * (1 + z));
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0)), azimuth = golden_angle * i;
  return {ring * std::cos(azimuth), ring * std::sin(azimuth), z};
}

}  // namespace lightwell
