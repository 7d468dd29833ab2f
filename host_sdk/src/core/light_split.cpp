#include "core/light_split.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

#include <lightwell/cap.hpp>
#include <lightwell/harmonics.hpp>
#include <lightwell/lobes.hpp>

namespace lightwell::core {
namespace {

constexpr int kBand = 2;
constexpr std::size_t kCount = 9;
constexpr int kResidualNormals = 512;

using Basis = std::array<double, kCount>;

Triple mapped(const ColorMatrix& color, double r, double g, double b) {
  Triple out;
  for (std::size_t i = 0; i < 3; ++i)
    out[i] = static_cast<double>(color.m[i][0]) * r + static_cast<double>(color.m[i][1]) * g +
             static_cast<double>(color.m[i][2]) * b;
  return out;
}

template <class Quantity>
Triple mapped(const ColorMatrix& color, Rgb<Quantity> c) {
  return mapped(color, static_cast<double>(c.r), static_cast<double>(c.g), static_cast<double>(c.b));
}

double luminance(const Triple& c) { return luminance_of(c[0], c[1], c[2]); }

/// Whether it fits into a float, even multiplied by a thousand (ARKit's neutral intensity).
bool presentable(const Triple& c) {
  constexpr double kMaxChannel = static_cast<double>(std::numeric_limits<float>::max()) / 1e4;
  return std::all_of(c.begin(), c.end(), [](double v) { return std::abs(v) <= kMaxChannel; });
}

void add(Triple& sum, const Triple& c, double factor) {
  for (std::size_t k = 0; k < 3; ++k) sum[k] += factor * c[k];
}

/// A light after ConversionOptions::color, with the zonal factor of its cap for each band.
struct MappedLight {
  Vec3d towards;  ///< Lightwell's axes.
  Triple irradiance{};
  double rho = 0;
  std::array<double, kBand + 1> zonal{1, 1, 1};
};

std::vector<MappedLight> mapped_lights(std::span<const Light> lights, const ColorMatrix& color) {
  std::vector<MappedLight> all;
  all.reserve(lights.size());
  for (const Light& light : lights) {
    MappedLight out{normalized(vec_cast<double>(light.direction)), mapped(color, light.irradiance),
                    static_cast<double>(light.angular_radius_rad)};
    for (int l = 0; l <= kBand; ++l) out.zonal[static_cast<std::size_t>(l)] = cap_zonal(l, out.rho);
    all.push_back(out);
  }
  return all;
}

int band_of(std::size_t i) { return i == 0 ? 0 : i < 4 ? 1 : 2; }

Basis basis_at(Vec3d d) {
  Basis y;
  sh_basis(kBand, d, y);
  return y;
}

/// Adds the coefficients of a directional light, each band times its factor.
void add_light(NineCoefficients& sum, Vec3d towards, const Triple& irradiance,
               const std::array<double, kBand + 1>& band_factor) {
  const Basis y = basis_at(towards);
  for (std::size_t i = 0; i < kCount; ++i)
    add(sum[i], irradiance, y[i] * band_factor[static_cast<std::size_t>(band_of(i))]);
}

/// Coefficients of the same function in other axes. Up to band 2 a function is a + b.d + d'Qd with Q symmetric and
/// traceless; b and Q transform as vector and matrix, also by a reflection.
NineCoefficients in_axes(const NineCoefficients& c, const Axes& axes) {
  const double y1 = 0.5 * std::sqrt(3 / std::numbers::pi), y2 = 0.5 * std::sqrt(15 / std::numbers::pi);
  const double y20 = 0.25 * std::sqrt(5 / std::numbers::pi);
  NineCoefficients out = c;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3d b = axes.of({c[3][k] * y1, c[1][k] * y1, c[2][k] * y1});
    const double xy = c[4][k] * y2 / 2, yz = c[5][k] * y2 / 2, xz = c[7][k] * y2 / 2;
    const double zz = c[6][k] * y20, difference = c[8][k] * y2 / 2;
    const Vec3d rows[3] = {{difference - zz, xy, xz}, {xy, -difference - zz, yz}, {xz, yz, 2 * zz}};
    const auto q = [&](Vec3d left, Vec3d right) {
      return dot(left, Vec3d{dot(rows[0], right), dot(rows[1], right), dot(rows[2], right)});
    };
    out[3][k] = b.x / y1;
    out[1][k] = b.y / y1;
    out[2][k] = b.z / y1;
    out[4][k] = 2 * q(axes.x, axes.y) / y2;
    out[5][k] = 2 * q(axes.y, axes.z) / y2;
    out[7][k] = 2 * q(axes.x, axes.z) / y2;
    out[6][k] = q(axes.z, axes.z) / 2 / y20;
    out[8][k] = (q(axes.x, axes.x) - q(axes.y, axes.y)) / y2;
  }
  return out;
}

/// Converted::residual. All in Lightwell's axes; `kept` and `main` are the target's harmonics and directional light.
float residual_of(const Descriptor& descriptor, std::span<const MappedLight> lights, const ColorMatrix& color,
                  const NineCoefficients& kept, const std::optional<DirectionalLight>& main) {
  const RadianceSh& sh = descriptor.radiance;
  std::array<double, kMaxBand + 1> lobe;
  for (int l = 0; l <= kMaxBand; ++l) lobe[static_cast<std::size_t>(l)] = cosine_lobe(l);
  std::array<double, sh_count(kMaxBand)> y{};
  double squared_error = 0, squared_truth = 0;
  for (int i = 0; i < kResidualNormals; ++i) {
    const Vec3d n = fibonacci_direction(i, kResidualNormals);
    sh_basis(std::max(sh.band, kBand), n, y);
    Triple target{}, ours{};
    for (int l = 0; l <= sh.band; ++l)
      for (int m = -l; m <= l; ++m) {
        const auto at = static_cast<std::size_t>(sh_index(l, m));
        const double weight = lobe[static_cast<std::size_t>(l)] * y[at];
        for (int k = 0; k < 3; ++k) ours[static_cast<std::size_t>(k)] += weight * static_cast<double>(sh.c[at][k]);
      }
    Triple truth = mapped(color, ours[0], ours[1], ours[2]);
    for (const MappedLight& light : lights)
      add(truth, light.irradiance, cap_irradiance(dot(light.towards, n), light.rho));
    for (std::size_t c = 0; c < kCount; ++c) add(target, kept[c], lobe[static_cast<std::size_t>(band_of(c))] * y[c]);
    if (main) add(target, main->irradiance, std::max(0.0, dot(main->towards, n)));
    for (std::size_t k = 0; k < 3; ++k) {
      squared_error += (target[k] - truth[k]) * (target[k] - truth[k]);
      squared_truth += truth[k] * truth[k];
    }
  }
  // Without light there is no error.
  return squared_truth > 0 ? static_cast<float>(std::sqrt(squared_error / squared_truth)) : 0.0F;
}

const MappedLight* brightest(std::span<const MappedLight> lights) {
  const auto found =
      std::ranges::max_element(lights, {}, [](const MappedLight& light) { return luminance(light.irradiance); });
  return found == lights.end() ? nullptr : &*found;
}

std::optional<DirectionalLight> directional(const MappedLight* light) {
  if (light == nullptr) return std::nullopt;
  DirectionalLight out{light->towards, {}, light->rho};
  for (std::size_t k = 0; k < 3; ++k) out.irradiance[k] = std::max(0.0, light->irradiance[k]);
  if (!(std::max({out.irradiance[0], out.irradiance[1], out.irradiance[2]}) > 0)) return std::nullopt;
  return out;
}

bool all_finite(const Descriptor& descriptor) {
  const RadianceSh& sh = descriptor.radiance;
  if (sh.band < 0 || sh.band > kMaxBand) return false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(sh.count()); ++i)
    if (!std::isfinite(sh.c[i].r + sh.c[i].g + sh.c[i].b)) return false;
  return std::all_of(descriptor.lights.begin(), descriptor.lights.end(), [](const Light& light) {
    return normalized(light.direction) != Vec3f{} && std::isfinite(light.angular_radius_rad) &&
           std::isfinite(light.irradiance.r + light.irradiance.g + light.irradiance.b);
  });
}

}  // namespace

SplitLight split(const Lighting& lighting, MainLight main, const Axes& axes, const ConversionOptions& options) {
  SplitLight out;
  out.validity = lighting.validity();
  if (!out.has_estimate()) return out;
  const Descriptor& descriptor = lighting.descriptor();
  if (!options.validate().ok() || !all_finite(descriptor)) {
    out.validity = Validity::invalid_query;
    return out;
  }
  NineCoefficients kept{};
  for (std::size_t i = 0; i < kCount && static_cast<int>(i) < descriptor.radiance.count(); ++i)
    kept[i] = mapped(options.color, descriptor.radiance.c[i]);
  const std::vector<MappedLight> lights = mapped_lights(descriptor.lights, options.color);
  const MappedLight* apart = main == MainLight::apart ? brightest(lights) : nullptr;
  std::optional<DirectionalLight> taken = directional(apart);
  for (const MappedLight& light : lights) {
    add_light(kept, light.towards, light.irradiance, light.zonal);
    // The target adds the main light as a point light, so the bands 0 to 2 of that are subtracted.
    if (taken && &light == apart) add_light(kept, light.towards, taken->irradiance, {-1, -1, -1});
  }
  if (!std::all_of(kept.begin(), kept.end(), presentable) || (taken && !presentable(taken->irradiance))) {
    out.validity = Validity::invalid_query;
    return out;
  }
  if (options.residual == Residual::measured)
    out.residual = residual_of(descriptor, lights, options.color, kept, taken);
  out.radiance = in_axes(kept, axes);
  if (taken) taken->towards = axes.of(taken->towards);
  out.main = taken;
  return out;
}

std::optional<DirectionalLight> strongest(const Lighting& lighting, const Axes& axes,
                                          const ConversionOptions& options) {
  const std::vector<MappedLight> lights = mapped_lights(lighting.lights(), options.color);
  std::optional<DirectionalLight> out = directional(brightest(lights));
  if (out) out->towards = axes.of(out->towards);
  return out;
}

NineCoefficients with_condon_shortley_signs(NineCoefficients coefficients) {
  for (const std::size_t odd : {1U, 3U, 5U, 7U})
    for (double& value : coefficients[odd]) value = -value;
  return coefficients;
}

NineCoefficients irradiance_over_pi_polynomial(const NineCoefficients& radiance) {
  const double root = std::sqrt(std::numbers::pi);
  // Constants of the basis functions (Sloan 2008, appendix A2, all positive) times A_l / pi = 1, 2/3, 1/4.
  const double band0 = 1 / (2 * root), band1 = std::sqrt(3.0) / (3 * root), band2 = std::sqrt(15.0) / (8 * root);
  const std::array<double, kCount> factor{band0, band1,    band1, band1, band2, band2, std::sqrt(5.0) / (16 * root),
                                          band2, band2 / 2};
  NineCoefficients out = radiance;
  for (std::size_t i = 0; i < kCount; ++i)
    for (double& value : out[i]) value *= factor[i];
  return out;
}

}  // namespace lightwell::core
