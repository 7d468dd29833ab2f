#include "field/residual.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <lightwell/cap.hpp>
#include <lightwell/lobes.hpp>

namespace lightwell::field {
namespace {

constexpr double kMargin_m = 0.05;  // Of the proxy geometry, beside lights that hang on it.
constexpr double kFar_m = 1000;
constexpr std::size_t kAll = sh_count(kMaxBand), kCompared = sh_count(4);
// Prior of the variogram: over the typical distance the irradiance without shared lights changes by this share of
// itself, with the weight of that many pairs of probes. Geometry explains a part of the change; its radiance comes from
// the same probes, so that their differences then say less.
struct ChangePrior {
  double share, pairs;
};
constexpr ChangePrior kPrior{0.7, 2}, kPriorWithSurround{0.3, 8};
// Close probes may differ by this many standard deviations.
constexpr double kMaxDeviation = 3, kClose_m = 1;

double square(double x) { return x * x; }

/// Of a shared light at a point: towards it, its distance (0: distant), irradiance at normal incidence and radius.
struct LightAtPoint {
  Vec3d direction;
  double distance_m = 0;
  Irradiance irradiance;
  double radius_rad = 0;
};

LightAtPoint light_at(const SharedLight& light, Vec3d point) {
  if (light.distant) return {light.direction, 0, light.intensity.mean, light.radius};
  const Vec3d to = light.position - point;
  const double distance = std::max(length(to), 1e-3);
  const Vec3d direction = to * (1 / distance);
  return {direction, distance, light.intensity.towards(-direction) * static_cast<float>(1 / square(distance)),
          std::asin(std::min(light.radius / distance, 1.0))};
}

bool hidden(const Proxy& proxy, Vec3d point, const LightAtPoint& seen) {
  const double reach = seen.distance_m > 0 ? seen.distance_m : kFar_m;
  return proxy.occluded(point, point + seen.direction * reach, std::max(kMargin_m, 0.02 * seen.distance_m));
}

/// Harmonics of the light as a cap.
RadianceSh cap_harmonics(const LightAtPoint& seen, int band) {
  RadianceSh out;
  out.band = band;
  std::array<float, kAll> basis;
  sh_basis(band, vec_cast<float>(seen.direction), std::span(basis).first(static_cast<std::size_t>(sh_count(band))));
  for (int l = 0; l <= band; ++l) {
    const auto zonal = static_cast<float>(cap_zonal(l, seen.radius_rad));
    for (int m = -l; m <= l; ++m) {
      const auto i = static_cast<std::size_t>(sh_index(l, m));
      const Irradiance e = seen.irradiance * (zonal * basis[i]);
      out.c[i] = {e.r, e.g, e.b};
    }
  }
  return out;
}

/// The part of the cap, 0 to 1, that the bands from 2 on contain.
double contained_part(const RadianceSh& sh, const RadianceSh& cap) {
  double both = 0, own = 0;
  for (std::size_t i = 4; i < static_cast<std::size_t>(sh.count()); ++i) {
    const auto c = static_cast<double>(cap.c[i].luminance());
    both += c * static_cast<double>(sh.c[i].luminance());
    own += c * c;
  }
  return own > 0 ? std::clamp(both / own, 0.0, 1.0) : 0;
}

void add_scaled(RadianceSh& out, const RadianceSh& sh, float factor) {
  out.band = std::max(out.band, sh.band);
  for (std::size_t i = 0; i < static_cast<std::size_t>(sh.count()); ++i) out.c[i] += sh.c[i] * factor;
}

/// Irradiance (luminance) as harmonics of the normal up to band 4: of the residual and of the node's own lights.
std::array<double, kCompared> irradiance_harmonics(const FieldNode& node) {
  std::array<double, kCompared> out{};
  const auto count = std::min(kCompared, static_cast<std::size_t>(node.residual_irradiance.count()));
  for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<double>(node.residual_irradiance.c[i].luminance());
  std::array<float, kCompared> basis;
  for (const Light& light : node.own_lights) {
    sh_basis(4, normalized(light.direction), basis);
    for (int l = 0; l <= 4; ++l)
      for (int m = -l; m <= l; ++m) {
        const auto i = static_cast<std::size_t>(sh_index(l, m));
        out[i] += luminance_of(light.irradiance) * cosine_lobe(l) * static_cast<double>(basis[i]);
      }
  }
  return out;
}

double mean_square(const std::array<double, kCompared>& a, const std::array<double, kCompared>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < kCompared; ++i) sum += square(a[i] - b[i]);
  return sum / (4 * std::numbers::pi);
}

}  // namespace

void split_residuals(std::span<const ProbeView> views, std::span<const Observation> observations,
                     std::span<const std::vector<std::size_t>> members, const Proxy* proxy,
                     std::span<SharedLight> lights, std::span<FieldNode> nodes) {
  // [view][light of the view]: matched.
  std::vector<std::vector<bool>> matched;
  for (const ProbeView& view : views) matched.emplace_back(view.lights.size());
  std::vector<std::vector<bool>> listed(views.size(), std::vector<bool>(lights.size()));
  for (std::size_t l = 0; l < lights.size(); ++l) {
    std::size_t contradicted = 0;
    for (const std::size_t m : members[l]) {
      const Observation& o = observations[m];
      matched[o.view][o.light] = true;
      listed[o.view][l] = true;
      if (proxy != nullptr && hidden(*proxy, o.origin, light_at(lights[l], o.origin))) ++contradicted;
    }
    lights[l].occluded_by_geometry = proxy != nullptr && 2 * contradicted < members[l].size();
  }
  for (std::size_t v = 0; v < views.size(); ++v) {
    const ProbeView& view = views[v];
    FieldNode& node = nodes[v];
    const auto scale = static_cast<float>(view.scale);
    node.residual.band = std::max(view.radiance.band, 2);
    add_scaled(node.residual, view.radiance, scale);
    double weakest = 0;
    for (std::size_t k = 0; k < view.lights.size(); ++k) {
      const double e = luminance_of(view.lights[k].irradiance) * view.scale;
      if (e > 0 && (weakest <= 0 || e < weakest)) weakest = e;
      if (matched[v][k]) continue;
      Light own = view.lights[k];
      own.irradiance = own.irradiance * scale;
      node.own_square += square(e) / 6;
      node.own_lights.push_back(own);
    }
    node.visibility.assign(lights.size(), 1);
    for (std::size_t l = 0; l < lights.size(); ++l) {
      if (listed[v][l]) continue;
      const LightAtPoint seen = light_at(lights[l], node.position);
      const double expected = luminance_of(seen.irradiance);
      const bool in_harmonics = lights[l].occluded_by_geometry ? !hidden(*proxy, node.position, seen)
                                                               : !(weakest > 0 && expected > 1.5 * weakest);
      node.visibility[l] = 0;
      if (!in_harmonics) continue;
      const RadianceSh cap = cap_harmonics(seen, view.radiance.band);
      const double part = contained_part(node.residual, cap);
      node.visibility[l] = static_cast<float>(part);
      add_scaled(node.residual, cap, -static_cast<float>(part));
    }
    node.residual_irradiance = irradiance_of(node.residual);
    node.rest_square = mean_square(irradiance_harmonics(node), {});
  }
}

std::shared_ptr<const Surround> subtract_surround(std::shared_ptr<const Proxy> proxy, std::span<const ProbeView> views,
                                                  std::span<FieldNode> nodes) {
  if (proxy == nullptr || nodes.empty()) return nullptr;
  std::vector<RadianceSh> residuals;
  for (const FieldNode& node : nodes) residuals.push_back(node.residual);
  auto out = std::make_shared<const Surround>(std::move(proxy), views, residuals);
  for (FieldNode& node : nodes) {
    add_scaled(node.residual, out->seen_from(node.position), -1);
    node.residual_irradiance = irradiance_of(node.residual);
  }
  return out;
}

double estimate_variogram(const FieldOptions& options, bool surround, std::span<const SharedLight> lights,
                          std::span<FieldNode> nodes) {
  if (nodes.empty()) return 0;
  std::vector<std::array<double, kCompared>> harmonics;
  std::vector<double> total;  // Mean square of the irradiance with all lights.
  double mean = 0;
  for (const FieldNode& node : nodes) {
    harmonics.push_back(irradiance_harmonics(node));
    mean += node.rest_square / static_cast<double>(nodes.size());
    total.push_back(node.rest_square);
    for (std::size_t l = 0; l < lights.size(); ++l)
      total.back() += square(static_cast<double>(node.visibility[l]) *
                             luminance_of(light_at(lights[l], node.position).irradiance)) /
                      6;
  }
  const double typical = variogram_shape(options.typical_distance_m);
  const ChangePrior& prior = surround ? kPriorWithSurround : kPrior;
  double sum = prior.pairs * square(prior.share) * mean / typical, pairs = prior.pairs;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const double h = length(nodes[i].position - nodes[k].position);
      const double difference = mean_square(harmonics[i], harmonics[k]);
      sum += difference / variogram_shape(std::max(h, 0.2));
      ++pairs;
      if (h > kClose_m) continue;
      const double level = std::max(total[i], total[k]);
      const double bound = static_cast<double>(std::min(nodes[i].bound, 1.0F) + std::min(nodes[k].bound, 1.0F)) + 0.1;
      const double expected = level * (square(kPrior.share) * variogram_shape(h) / typical + square(bound));
      if (difference > square(kMaxDeviation) * expected) nodes[i].contradicted = nodes[k].contradicted = true;
    }
  return sum / pairs;
}

}  // namespace lightwell::field
