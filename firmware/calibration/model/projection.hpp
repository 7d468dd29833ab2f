// Projection of directions to pixels for any scalar type: float, double, and dual numbers for automatic
// differentiation.
//   KannalaBrandtModel  DoubleSphereModel  MeiModel
//   with_model  parameters_of  parameter_names  with_parameters
// A model has kParameters numbers, in the order of its parameters struct: fx, fy, cx, cy, then its own. Directions are
// in the lens frame, axes _cv (x right, y down, z forward), of any length. project() returns false only if the formula
// has no value; CameraModel checks the domain.
#pragma once

#include <array>
#include <cmath>
#include <variant>
#include <vector>

#include <lightwell/calibration.hpp>

namespace lightwell {

/// Kannala & Brandt 2006, coefficients as in OpenCV's fisheye: r = theta (1 + k1 theta² + ... + k4 theta⁸).
struct KannalaBrandtModel {
  using Parameters = KannalaBrandtParameters;
  static constexpr std::size_t kParameters = 8;
  static constexpr std::array<const char*, kParameters> kNames{"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};
  static std::array<double, kParameters> values(const Parameters& k) {
    return {k.fx, k.fy, k.cx, k.cy, k.k1, k.k2, k.k3, k.k4};
  }
  static Parameters from(const double* p) { return {p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7]}; }

  template <class T>
  static T radius(const T* p, const T& theta) {
    const T t = theta * theta;
    return theta * (T(1) + t * (p[4] + t * (p[5] + t * (p[6] + t * p[7]))));
  }

  template <class T>
  static bool project(const T* p, const T& x, const T& y, const T& z, T& u, T& v) {
    using std::atan2, std::sqrt;
    const T across2 = x * x + y * y;
    // Near the axis r / across tends to 1 / z, and the square root has no derivative at zero. Below this threshold the
    // next term of the series is below the precision of double.
    T scale;
    if (across2 <= T(1e-16) * z * z) {
      if (!(z > T(0))) return false;
      scale = T(1) / z;
    } else {
      const T across = sqrt(across2);
      scale = radius(p, T(atan2(across, z))) / across;
    }
    u = p[0] * scale * x + p[2];
    v = p[1] * scale * y + p[3];
    return true;
  }
};

/// Usenko, Demmel & Cremers 2018, eq. 40 to 42.
struct DoubleSphereModel {
  using Parameters = DoubleSphereParameters;
  static constexpr std::size_t kParameters = 6;
  static constexpr std::array<const char*, kParameters> kNames{"fx", "fy", "cx", "cy", "xi", "alpha"};
  static std::array<double, kParameters> values(const Parameters& d) { return {d.fx, d.fy, d.cx, d.cy, d.xi, d.alpha}; }
  static Parameters from(const double* p) { return {p[0], p[1], p[2], p[3], p[4], p[5]}; }

  template <class T>
  static bool project(const T* p, const T& x, const T& y, const T& z, T& u, T& v) {
    using std::sqrt;
    const T across2 = x * x + y * y;
    const T shifted = p[4] * sqrt(across2 + z * z) + z;
    const T denominator = p[5] * sqrt(across2 + shifted * shifted) + (T(1) - p[5]) * shifted;
    if (!(denominator > T(0))) return false;
    u = p[0] * x / denominator + p[2];
    v = p[1] * y / denominator + p[3];
    return true;
  }
};

/// Mei & Rives 2007, eq. 2 to 6, with the distortion in OpenCV's order (omnidir): projection of the unit sphere from a
/// point xi behind its centre, then radial (k1, k2) and tangential (p1, p2) distortion.
struct MeiModel {
  using Parameters = MeiParameters;
  static constexpr std::size_t kParameters = 9;
  static constexpr std::array<const char*, kParameters> kNames{"fx", "fy", "cx", "cy", "xi", "k1", "k2", "p1", "p2"};
  static std::array<double, kParameters> values(const Parameters& m) {
    return {m.fx, m.fy, m.cx, m.cy, m.xi, m.k1, m.k2, m.p1, m.p2};
  }
  static Parameters from(const double* p) { return {p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8]}; }

  /// Distorts a point of the plane at distance one.
  template <class T>
  static void distort(const T* p, const T& x, const T& y, T& u, T& v) {
    const T r2 = x * x + y * y, along = T(1) + r2 * (p[5] + r2 * p[6]), xy2 = T(2) * x * y;
    u = x * along + p[7] * xy2 + p[8] * (r2 + T(2) * x * x);
    v = y * along + p[7] * (r2 + T(2) * y * y) + p[8] * xy2;
  }

  template <class T>
  static bool project(const T* p, const T& x, const T& y, const T& z, T& u, T& v) {
    using std::sqrt;
    const T denominator = z + p[4] * sqrt(x * x + y * y + z * z);
    if (!(denominator > T(0))) return false;
    T du, dv;
    distort(p, T(x / denominator), T(y / denominator), du, dv);
    u = p[0] * du + p[2];
    v = p[1] * dv + p[3];
    return true;
  }
};

/// Calls `f(Model{}, parameters)` with the model of these parameters, which must not be equirectangular.
template <class F>
decltype(auto) with_model(const ModelParameters& model, F&& f) {
  if (const auto* k = std::get_if<KannalaBrandtParameters>(&model)) return f(KannalaBrandtModel{}, *k);
  if (const auto* d = std::get_if<DoubleSphereParameters>(&model)) return f(DoubleSphereModel{}, *d);
  return f(MeiModel{}, std::get<MeiParameters>(model));
}

/// The parameters as numbers, in the order of the model's kNames.
[[nodiscard]] inline std::vector<double> parameters_of(const ModelParameters& model) {
  return with_model(model, [](auto m, const auto& parameters) {
    const auto values = decltype(m)::values(parameters);
    return std::vector<double>(values.begin(), values.end());
  });
}

/// The names of the parameters, as in calibration.proto.
[[nodiscard]] inline std::vector<const char*> parameter_names(const ModelParameters& model) {
  return with_model(model, [](auto m, const auto&) {
    return std::vector<const char*>(decltype(m)::kNames.begin(), decltype(m)::kNames.end());
  });
}

/// A model of the same kind as `like` with the given numbers, as many as parameters_of(like).
[[nodiscard]] inline ModelParameters with_parameters(const ModelParameters& like, const double* numbers) {
  return with_model(like, [&](auto m, const auto&) -> ModelParameters { return decltype(m)::from(numbers); });
}

}  // namespace lightwell
