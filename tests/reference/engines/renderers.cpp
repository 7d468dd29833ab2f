#include "reference/engines/renderers.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "reference/engines/condon_shortley.hpp"

namespace lightwell::reference::engines {

namespace {

using Triple = std::array<double, 3>;
using Four = std::array<double, 4>;

double from_behind(const V3& normal, const Triple& forward) {
  return std::max(0.0, -dot(normal, {forward[0], forward[1], forward[2]}));
}

double dot4(const Four& a, const Four& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]; }

/// The terms of one channel that Unity and Unreal share, packed in registers: (n, 1), (xy, yz, zz, zx), xx - yy.
double registers(const Four& a, const Four& b, double c, const V3& n) {
  return dot4(a, {n.x, n.y, n.z, 1.0}) + dot4(b, {n.x * n.y, n.y * n.z, n.z * n.z, n.z * n.x}) +
         c * (n.x * n.x - n.y * n.y);
}

Triple filament_polynomial(const std::array<Triple, 9>& sh, const V3& n) {
  const double terms[9] = {1, n.y, n.z, n.x, n.y * n.x, n.y * n.z, 3 * n.z * n.z - 1, n.z * n.x, n.x * n.x - n.y * n.y};
  Triple sum{};
  for (std::size_t i = 0; i < 9; ++i)
    for (std::size_t k = 0; k < 3; ++k) sum[k] += sh[i][k] * terms[i];
  return sum;
}

Rgb filament_total(const std::array<Triple, 9>& prescaled, const FilamentScene& scene, const V3& normal) {
  const Triple diffuse = filament_polynomial(prescaled, normal);
  const double n_dot_l = from_behind(normal, scene.light_direction);
  Rgb out{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double indirect = diffuse[k] * scene.indirect_intensity;
    const double direct = scene.light_color[k] * scene.light_intensity_lux * n_dot_l / pi;
    out[k] = pi * (indirect + direct);
  }
  return out;
}

}  // namespace

Rgb unity_irradiance(const UnityScene& scene, UnityPipeline pipeline, const V3& normal) {
  Rgb out{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& sh = scene.sh[k];
    const Four a{sh[3], sh[1], sh[2], sh[0] - sh[6]};
    const Four b{sh[4], sh[5], 3 * sh[6], sh[7]};
    const double ambient = registers(a, b, sh[8], normal);
    const double lit = scene.light_color[k] * scene.light_intensity * from_behind(normal, scene.light_forward);
    out[k] = pi * (ambient + (pipeline == UnityPipeline::universal ? lit : lit / pi));
  }
  return out;
}

Rgb three_irradiance(const ThreeScene& scene, ThreeLights lights, const V3& normal) {
  const double x = normal.x, y = normal.y, z = normal.z;
  const double c1 = 0.25 * std::sqrt(15.0 / pi) * pi / 4;  // 0.429043, and so on, to all digits
  const double c2 = 0.25 * std::sqrt(3.0 / pi) * 2 * pi / 3;
  const double c3 = 0.75 * std::sqrt(5.0 / pi) * pi / 4;
  const double c4 = 0.5 * std::sqrt(1.0 / pi) * pi;
  const double c5 = c3 / 3;
  const double factor[9] = {c4,
                            2 * c2 * y,
                            2 * c2 * z,
                            2 * c2 * x,
                            2 * c1 * x * y,
                            2 * c1 * y * z,
                            c3 * z * z - c5,
                            2 * c1 * x * z,
                            c1 * (x * x - y * y)};
  const V3 towards = normalised({scene.light_position[0], scene.light_position[1], scene.light_position[2]});
  const double n_dot_l = std::max(0.0, dot(normal, towards)) * (lights == ThreeLights::legacy ? pi : 1.0);
  Rgb out{};
  for (std::size_t k = 0; k < 3; ++k) {
    double irradiance = scene.light_color[k] * scene.light_intensity * n_dot_l;
    for (std::size_t i = 0; i < 9; ++i) irradiance += factor[i] * scene.sh[i][k] * scene.probe_intensity;
    out[k] = pi * (irradiance / pi);
  }
  return out;
}

Rgb filament_irradiance(const FilamentScene& scene, const V3& normal) {
  return filament_total(scene.irradiance, scene, normal);
}

Rgb filament_irradiance_from_radiance(const FilamentScene& scene, const V3& normal) {
  const double s = std::sqrt(pi);
  // A_l^m of the table to all digits, C_l / pi = 1, 2/3, 1/4.
  const double a[9] = {1 / (2 * s),
                       -std::sqrt(3.0) / (2 * s),
                       std::sqrt(3.0) / (2 * s),
                       -std::sqrt(3.0) / (2 * s),
                       std::sqrt(15.0) / (2 * s),
                       -std::sqrt(15.0) / (2 * s),
                       std::sqrt(5.0) / (4 * s),
                       -std::sqrt(15.0) / (2 * s),
                       std::sqrt(15.0) / (4 * s)};
  std::array<Triple, 9> prescaled{};
  for (std::size_t i = 0; i < 9; ++i) {
    const double c = i == 0 ? 1.0 : i < 4 ? 2.0 / 3.0 : 0.25;
    for (std::size_t k = 0; k < 3; ++k) prescaled[i][k] = scene.radiance[i][k] * a[i] * c;
  }
  return filament_total(prescaled, scene, normal);
}

Rgb unreal_irradiance(const UnrealScene& scene, const V3& normal) {
  const double s = std::sqrt(pi);
  const double c0 = 1 / (2 * s), c1 = std::sqrt(3.0) / (3 * s), c2 = std::sqrt(15.0) / (8 * s),
               c3 = std::sqrt(5.0) / (16 * s), c4 = 0.5 * c2;
  const std::array<const std::array<double, 9>*, 3> planes{&scene.r, &scene.g, &scene.b};
  Rgb out{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& v = *planes[k];
    const Four a{-c1 * v[3], -c1 * v[1], c1 * v[2], c0 * v[0] - c3 * v[6]};
    const Four b{c2 * v[4], -c2 * v[5], 3 * c3 * v[6], -c2 * v[7]};
    const double sky = registers(a, b, c4 * v[8], normal);
    const double sun = scene.light_color[k] * scene.light_intensity_lux * from_behind(normal, scene.light_forward) / pi;
    out[k] = pi * (sky + sun);
  }
  return out;
}

std::array<double, 9> unreal_basis(const V3& direction) {
  std::array<double, 9> out{};
  for (int l = 0, i = 0; l <= 2; ++l)
    for (int m = -l; m <= l; ++m, ++i) out[static_cast<std::size_t>(i)] = condon_shortley(l, m, direction);
  return out;
}

}  // namespace lightwell::reference::engines
