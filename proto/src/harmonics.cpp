#include <cmath>
#include <numbers>
#include <vector>

#include <lightwell/harmonics.hpp>
#include <lightwell/lobes.hpp>

#include "gauss_legendre.hpp"

namespace lightwell {
namespace {

ShRecursion make_recursion() {
  ShRecursion r;
  double diagonal = std::sqrt(0.25 / std::numbers::pi);
  for (int m = 0; m <= kMaxBasisBand; ++m) {
    if (m > 0) diagonal *= std::sqrt((2.0 * m + 1) / (2.0 * m));
    r.start[m] = m > 0 ? std::numbers::sqrt2 * diagonal : diagonal;
    for (int l = m + 1; l <= kMaxBasisBand; ++l) {
      const double ll = l * l, mm = m * m, below = (l - 1.0) * (l - 1.0);
      r.a[l][m] = std::sqrt((4 * ll - 1) / (ll - mm));
      r.b[l][m] = std::sqrt((below - mm) / (4 * below - 1));
    }
  }
  return r;
}

const ShRecursion kRecursion = make_recursion();

template <class T>
void basis(int band, Vec3<T> d, std::span<T> out) {
  // Real and imaginary part of (x + iy)^m are sin(theta)^m times the cosine and sine of m phi.
  T re = 1, im = 0;
  for (int m = 0; m <= band; ++m) {
    T previous = 0, current = static_cast<T>(kRecursion.start[m]);
    for (int l = m;; ++l) {
      const auto at = static_cast<std::size_t>(l * (l + 1));
      const auto order = static_cast<std::size_t>(m);
      out[at + order] = current * re;
      if (m > 0) out[at - order] = current * im;
      if (l == band) break;
      const T next =
          static_cast<T>(kRecursion.a[l + 1][m]) * (d.z * current - static_cast<T>(kRecursion.b[l + 1][m]) * previous);
      previous = current;
      current = next;
    }
    const T turned = re * d.x - im * d.y;
    im = re * d.y + im * d.x;
    re = turned;
  }
}

/// Bands 0 to 2, the most frequent case, without the recursion's loops.
template <class Quantity>
Rgb<Quantity> evaluate_band_2(const Sh<Quantity>& sh, Vec3f d) {
  constexpr float k0 = 0.28209479177387814F, k1 = 0.4886025119029199F, k2 = 1.0925484305920792F,
                  k3 = 0.31539156525252005F, k4 = 0.5462742152960396F;
  const float y[9] = {k0,
                      k1 * d.y,
                      k1 * d.z,
                      k1 * d.x,
                      k2 * d.x * d.y,
                      k2 * d.y * d.z,
                      k3 * (3 * d.z * d.z - 1),
                      k2 * d.x * d.z,
                      k4 * (d.x * d.x - d.y * d.y)};
  Rgb<Quantity> sum;
  for (std::size_t i = 0; i < 9; ++i) sum += sh.c[i] * y[i];
  return sum;
}

template <class Quantity>
Rgb<Quantity> evaluate_any(const Sh<Quantity>& sh, Vec3f d) {
  if (sh.band == 2) return evaluate_band_2(sh, d);
  std::array<float, sh_count(kMaxBand)> y;
  basis<float>(sh.band, d, y);
  Rgb<Quantity> sum;
  for (std::size_t i = 0; i < static_cast<std::size_t>(sh.count()); ++i) sum += sh.c[i] * y[i];
  return sum;
}

struct SphereNode {
  Vec3d direction;
  double weight;
};

/// Quadrature that is exact for products of two functions of band kMaxBand.
std::vector<SphereNode> sphere_rule() {
  std::vector<SphereNode> nodes;
  for_each_sphere_node(kMaxBand + 1, 2 * kMaxBand + 1, 0, [&](Vec3d direction, double weight) {
    nodes.push_back({direction, weight});
  });
  return nodes;
}

}  // namespace

void sh_basis(int band, Vec3d d, std::span<double> out) { basis<double>(band, d, out); }
void sh_basis(int band, Vec3f d, std::span<float> out) { basis<float>(band, d, out); }
const ShRecursion& sh_recursion() { return kRecursion; }

Radiance evaluate(const RadianceSh& sh, Vec3f d) { return evaluate_any(sh, d); }
Irradiance evaluate(const IrradianceSh& sh, Vec3f normal) { return evaluate_any(sh, normal); }

RadianceSh rotated(const RadianceSh& sh, Quat q) {
  static const std::vector<SphereNode> rule = sphere_rule();
  const Quat unit = q.normalized();
  const auto count = static_cast<std::size_t>(sh.count());
  std::array<std::array<double, 3>, sh_count(kMaxBand)> sum{};
  std::array<double, sh_count(kMaxBand)> here, there;
  for (const SphereNode& node : rule) {
    // rotated(f)(d) = f(q^-1 d). Its projection by the quadrature is exact, because f has no band above kMaxBand.
    basis<double>(sh.band, rotate(unit.inverse(), node.direction), there);
    basis<double>(sh.band, node.direction, here);
    double value[3] = {};
    for (std::size_t i = 0; i < count; ++i) {
      value[0] += sh.c[i].r * there[i];
      value[1] += sh.c[i].g * there[i];
      value[2] += sh.c[i].b * there[i];
    }
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < 3; ++k) sum[i][k] += node.weight * value[k] * here[i];
  }
  RadianceSh out;
  out.band = sh.band;
  for (std::size_t i = 0; i < count; ++i)
    out.c[i] = {static_cast<float>(sum[i][0]), static_cast<float>(sum[i][1]), static_cast<float>(sum[i][2])};
  return out;
}

IrradianceSh irradiance_of(const RadianceSh& sh) {
  IrradianceSh out;
  out.band = sh.band;
  for (int l = 0; l <= sh.band; ++l) {
    const auto a = static_cast<float>(cosine_lobe(l));
    for (int m = -l; m <= l; ++m) {
      const auto i = static_cast<std::size_t>(sh_index(l, m));
      out.c[i] = {a * sh.c[i].r, a * sh.c[i].g, a * sh.c[i].b};
    }
  }
  return out;
}

}  // namespace lightwell
