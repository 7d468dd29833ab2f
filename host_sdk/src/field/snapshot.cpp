#include "field/snapshot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <lightwell/cap.hpp>
#include <lightwell/lobes.hpp>

#include "core/irradiance_rows.hpp"
#include "core/sample.hpp"
#include "field/views.hpp"

namespace lightwell::field {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kConfidence = 2;    // Standard deviations of the bound, 95 %.
constexpr double kLargestBound = 1;  // Beyond, a bound says nothing.
constexpr double kSmallestDistance_m = 0.05;
constexpr double kOccluderMargin_m = 0.03;
constexpr double kWide = 0.2;            // Radius by distance from which the shape of a flat emitter matters.
constexpr double kContributes = 0.1;     // Weight from which a probe's age, flags and contradictions count.
constexpr std::size_t kMomentCount = 9;  // Coefficients up to band 2: 99 % of the energy of a clamped cosine.

/// A light at a point.
struct LightHere {
  Light light;
  double variance = 0;  ///< Mean square over normals of its error (luminance).
};

/// What an answer sums up: irradiance (luminance) as harmonics of the normal, and the variance of its error.
struct Moments {
  std::array<double, kMomentCount> irradiance{};
  double variance = 0;

  void add(const LightHere& here) {
    const double e = luminance_of(here.light.irradiance);
    std::array<float, kMomentCount> basis;
    sh_basis(2, here.light.direction, basis);
    for (std::size_t i = 0; i < kMomentCount; ++i)
      irradiance[i] += e * cosine_lobe(i == 0 ? 0 : i < 4 ? 1 : 2) * static_cast<double>(basis[i]);
    variance += here.variance;
  }
  [[nodiscard]] double mean_square() const {
    double sum = 0;
    for (const double c : irradiance) sum += c * c;
    return sum / (4 * std::numbers::pi);
  }
};

/// Of a directional light: mean over normals of max(0, cos)².
constexpr double kCosineSquare = 1.0 / 6;

class Query {
 public:
  Query(const FieldSnapshot& field, Vec3d position, HostTime now)
      : field_(field), position_(position), weights_(field.weights_at(position)) {
    for (std::size_t k = 0; k < weights_.count; ++k) {
      const FieldNode& node = this->node(k);
      nearest_m_ = std::min(nearest_m_, weights_.distance_m[k]);
      if (weights_.weight[k] < kContributes) continue;
      age_ = std::max(age_, now - node.mid_exposure);
      uncertainty_ = std::max(uncertainty_, node.time_uncertainty);
      if (node.contradicted) flags.set(FieldFlag::contradiction);
      for (const Flag f : kFlags)
        if (node.flags.has(f)) light_flags.set(f);
    }
    if (weights_.count == 1) flags.set(FieldFlag::one_probe);
    if (nearest_m_ > field.options.typical_distance_m) flags.set(FieldFlag::far_from_probes);
  }

  [[nodiscard]] bool empty() const { return weights_.count == 0; }
  [[nodiscard]] double nearest_m() const { return nearest_m_; }
  [[nodiscard]] Duration age() const { return age_; }
  [[nodiscard]] Duration uncertainty() const { return uncertainty_; }
  [[nodiscard]] bool stale() const { return age_ + uncertainty_ > field_.options.max_age; }
  [[nodiscard]] const Weights& weights() const { return weights_; }
  [[nodiscard]] const FieldNode& node(std::size_t k) const { return field_.nodes[weights_.node[k]]; }

  /// Calls sink(LightHere) for every light that reaches the point.
  template <class Sink>
  void lights(Sink&& sink) {
    for (std::size_t l = 0; l < field_.lights.size(); ++l) shared(l, sink);
    for (std::size_t k = 0; k < weights_.count; ++k) {
      const auto w = static_cast<float>(weights_.weight[k]);
      if (w < 1e-4F) continue;
      for (const Light& own : node(k).own_lights) {
        LightHere here{own};
        here.light.irradiance = own.irradiance * w;
        here.light.track = 0;
        sink(here);
      }
    }
  }

  /// The residual's share of the error's variance: of the weighted mean of probes that are not here (the variance of a
  /// linear estimator under a variogram, Chiles & Delfiner 2012, eq. 3.2), and of their own lights, which may be near.
  [[nodiscard]] double residual_variance() const {
    double out = 0, between = 0;
    const double reach = field_.options.typical_distance_m;
    for (std::size_t i = 0; i < weights_.count; ++i) {
      const double w = weights_.weight[i], h = weights_.distance_m[i];
      out += w * field_.variogram * variogram_shape(h);
      const double turn = std::min(1.0, 2 * h / reach);
      out += w * node(i).own_square * turn * turn;
      for (std::size_t k = 0; k < i; ++k)
        between += w * weights_.weight[k] * variogram_shape(length(node(i).position - node(k).position));
    }
    return std::max(out - field_.variogram * between, 0.0);
  }

  [[nodiscard]] double bound(const Moments& moments) const {
    double own = 0;
    for (std::size_t k = 0; k < weights_.count; ++k) own += weights_.weight[k] * static_cast<double>(node(k).bound);
    const double square = moments.mean_square();
    if (!(square > 0) || flags.has(FieldFlag::contradiction) || flags.has(FieldFlag::at_light)) return kInfinite;
    const double out = own + kConfidence * std::sqrt((moments.variance + residual_variance()) / square);
    return out <= kLargestBound ? out : kInfinite;
  }

  FieldFlags flags;
  Flags light_flags;

 private:
  template <class Sink>
  void shared(std::size_t l, Sink& sink) {
    const SharedLight& s = field_.lights[l];
    LightHere here;
    double distance = 0, turn2 = 0, spread2 = 0;  // Variances of the direction in a tangent, and of log irradiance.
    Vec3d direction;
    if (s.distant) {
      direction = s.direction;
      here.light.irradiance = s.intensity.mean;
      here.light.angular_radius_rad = static_cast<float>(s.radius);
      const double away = length(position_ - s.center);
      turn2 = s.direction_sigma_rad * s.direction_sigma_rad + away * away * s.parallax_sigma * s.parallax_sigma;
      spread2 = relative_square(s, {});
    } else {
      const Vec3d to = s.position - position_;
      distance = length(to);
      const double place2 = (s.covariance[0] + s.covariance[3] + s.covariance[5]) / 3;
      if (distance < s.radius || distance * distance < 9 * place2 || distance < kSmallestDistance_m)
        flags.set(FieldFlag::at_light);
      const double clear = std::max({distance, s.radius, kSmallestDistance_m});
      direction = distance > 1e-9 ? to * (1 / distance) : Vec3d{0, 1, 0};
      here.light.irradiance = s.intensity.towards(-direction) * static_cast<float>(1 / (clear * clear));
      if (s.radius > kWide * clear) near_flat_emitter(s, direction, here.light.irradiance);
      here.light.angular_radius_rad = static_cast<float>(std::asin(std::min(s.radius / clear, 1.0)));
      const double along2 = std::max(quadratic(s.covariance, direction, direction), 0.0);
      turn2 = std::max(3 * place2 - along2, 0.0) / (2 * clear * clear);
      // Irradiance falls with the squared distance; near a light its shape matters.
      const double shape = 0.5 * s.radius * s.radius / (clear * clear);
      spread2 = relative_square(s, -direction) + 4 * along2 / (clear * clear) + shape * shape;
      here.light.distance_m = static_cast<float>(distance);
      here.light.distance_sigma_m = static_cast<float>(std::sqrt(along2) + 1e-4);
      if (distance <= 0) here.light.distance_m = here.light.distance_sigma_m = 0;
    }
    double part_variance = 0;
    const double seen = visibility(l, direction, distance, part_variance);
    const double free = luminance_of(here.light.irradiance);
    if (!(free > 0) || (seen < 1e-3 && part_variance < 1e-6)) return;
    here.light.direction = vec_cast<float>(direction);
    here.light.track = s.id;
    here.light.irradiance = here.light.irradiance * static_cast<float>(seen);
    const auto variance = static_cast<float>(turn2);
    here.light.direction_covariance = {variance, 0, variance};
    here.variance = free * free * kCosineSquare *
                    (seen * seen * (std::min(spread2, 1.0) + 2 * std::min(turn2, 1.0)) + part_variance);
    sink(here);
  }

  /// Close to a flat emitter: the vector irradiance of its disc as that of five of its points.
  void near_flat_emitter(const SharedLight& s, Vec3d& direction, Irradiance& irradiance) const {
    const auto& g = s.intensity.gradient;
    const Vec3d gradient{luminance_of(g[0]), luminance_of(g[1]), luminance_of(g[2])};
    if (!(length(gradient) > luminance_of(s.intensity.mean))) return;
    const auto [u, v] = tangent_basis(normalized(gradient));
    const double r = s.radius * std::numbers::sqrt2 / 2;  // Of the annulus with the same second moment.
    Irradiance sum;
    Vec3d toward;
    for (const auto& [a, b] : {std::pair{0.0, 0.0}, {r, 0.0}, {-r, 0.0}, {0.0, r}, {0.0, -r}}) {
      const Vec3d to = s.position + u * a + v * b - position_;
      const double distance = std::max(length(to), kSmallestDistance_m);
      const Irradiance part =
          s.intensity.towards(to * (-1 / distance)) * static_cast<float>(0.2 / (distance * distance));
      sum += part;
      toward += to * (luminance_of(part) / distance);
    }
    const double all = luminance_of(sum);
    if (!(all > 0) || toward == Vec3d{}) return;
    direction = normalized(toward);
    irradiance = sum * static_cast<float>(length(toward) / all);
  }

  static double relative_square(const SharedLight& s, Vec3d from_light) {
    const double towards = luminance_of(s.intensity.towards(from_light));
    const double ratio = towards > 0 ? s.intensity.sigma(from_light) / towards : 1;
    return ratio * ratio;
  }

  /// The visible part of a shared light, and the variance of that.
  double visibility(std::size_t l, Vec3d direction, double distance, double& part_variance) {
    const SharedLight& s = field_.lights[l];
    if (s.occluded_by_geometry) {
      const double part = by_geometry(s, direction, distance);
      part_variance = part * (1 - part) / 4;
      return part;
    }
    double part = 0;
    for (std::size_t k = 0; k < weights_.count; ++k)
      part += weights_.weight[k] * static_cast<double>(node(k).visibility[l]);
    part_variance = std::max(part * (1 - part), 0.0);
    if (part_variance > 0.05) flags.set(FieldFlag::occlusion_unknown);
    return part;
  }

  double by_geometry(const SharedLight& s, Vec3d direction, double distance) const {
    constexpr double kFar_m = 1000;
    const Proxy& proxy = field_.surround->proxy();
    if (s.distant) return proxy.occluded(position_, position_ + direction * kFar_m, kOccluderMargin_m) ? 0 : 1;
    const double margin = std::max(kOccluderMargin_m, 0.02 * distance);
    const auto [u, v] = tangent_basis(direction);
    const double r = 0.6 * std::min(s.radius, distance / 2);
    int seen = 0;
    for (const auto& [a, b] : {std::pair{r, 0.0}, {-r, 0.0}, {0.0, r}, {0.0, -r}})
      seen += proxy.occluded(position_, s.position + u * a + v * b, margin) ? 0 : 1;
    return seen / 4.0;
  }

  const FieldSnapshot& field_;
  Vec3d position_;
  Weights weights_;
  double nearest_m_ = kInfinite;
  Duration age_, uncertainty_;
};

void add_moments(const IrradianceSh& sh, double weight, Moments& out) {
  const auto count = std::min(kMomentCount, static_cast<std::size_t>(sh.count()));
  for (std::size_t i = 0; i < count; ++i) out.irradiance[i] += weight * static_cast<double>(sh.c[i].luminance());
}

}  // namespace

double variogram_shape(double distance_m) { return distance_m * std::sqrt(distance_m); }

Weights FieldSnapshot::weights_at(Vec3d position) const {
  Weights out;
  std::array<std::pair<double, std::size_t>, Weights::kNearest + 1> nearest;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const double distance = length(nodes[i].position - position);
    std::size_t place = kept < nearest.size() ? kept++ : kept;
    if (place == nearest.size()) {
      if (distance >= nearest.back().first) continue;
      --place;
    }
    for (; place > 0 && nearest[place - 1].first > distance; --place) nearest[place] = nearest[place - 1];
    nearest[place] = {distance, i};
  }
  out.count = std::min(kept, Weights::kNearest);
  const double reach = kept > Weights::kNearest ? nearest[Weights::kNearest].first : kInfinite;
  double sum = 0;
  for (std::size_t k = 0; k < out.count; ++k) {
    const auto [distance, index] = nearest[k];
    out.node[k] = index;
    out.distance_m[k] = distance;
    const double fall = std::isfinite(reach) ? std::max(1 - distance / reach, 0.0) : 1;
    const double clear = std::max(distance, 1e-3);
    out.weight[k] = fall * fall / (clear * clear) + 1e-12;
    sum += out.weight[k];
  }
  for (std::size_t k = 0; k < out.count; ++k) out.weight[k] /= sum;
  return out;
}

FieldAnswer FieldSnapshot::at(Vec3d position, HostTime now) const {
  FieldAnswer out;
  out.nearest_probe_m = kInfinite;
  if (!is_finite(position)) {
    out.light = Lighting(nullptr, Validity::invalid_query, {}, options.max_age);
    return out;
  }
  Query query(*this, position, now);
  if (query.empty()) return out;
  core::Sample sample;
  Descriptor& d = sample.descriptor;
  d.units = state->units;
  d.sequence = state->updates;
  d.T_probe_origin.translation = position;
  d.coverage = 1;
  Moments moments;
  const auto add = [&](const RadianceSh& sh, float weight) {
    d.radiance.band = std::max(d.radiance.band, sh.band);
    const auto count = static_cast<std::size_t>(sh.count());
    for (std::size_t i = 0; i < count; ++i) d.radiance.c[i] += sh.c[i] * weight;
  };
  const Weights& w = query.weights();
  for (std::size_t k = 0; k < w.count; ++k) add(query.node(k).residual, static_cast<float>(w.weight[k]));
  if (surround) add(surround->seen_from(position), 1);
  d.lights.reserve(lights.size() + 8);
  query.lights([&](const LightHere& here) {
    moments.add(here);
    if (luminance_of(here.light.irradiance) > 0) d.lights.push_back(here.light);
  });
  std::ranges::sort(d.lights, std::greater<>{}, [](const Light& l) { return luminance_of(l.irradiance); });
  if (d.lights.size() > kMaxLights) d.lights.resize(kMaxLights);
  core::prepare(sample);
  add_moments(sample.irradiance, 1, moments);
  d.bound.total = static_cast<float>(query.bound(moments));
  d.flags = query.light_flags;
  if (!std::isfinite(d.bound.total)) d.flags.set(Flag::unsure);
  sample.mid_exposure = now - query.age();
  sample.received = sample.mid_exposure;
  sample.time_uncertainty = query.uncertainty();
  core::add_reconstruction(sample);
  out.flags = query.flags;
  out.nearest_probe_m = query.nearest_m();
  out.light = Lighting(std::make_shared<const core::Sample>(std::move(sample)),
                       query.stale() ? Validity::stale : Validity::valid, std::max(query.age(), Duration{}),
                       options.max_age, Derivation::interpolated);
  return out;
}

Answer<Irradiance> FieldSnapshot::irradiance(Vec3d position, Vec3f normal, HostTime now) const {
  Answer<Irradiance> out;
  const Vec3d n = normalized(vec_cast<double>(normal));
  if (!is_finite(position) || n == Vec3d{}) {
    out.validity = Validity::invalid_query;
    return out;
  }
  Query query(*this, position, now);
  if (query.empty()) return out;
  Moments moments;
  std::array<float, sh_count(kMaxBand)> basis;
  sh_basis(kMaxBand, vec_cast<float>(n), basis);
  const auto add = [&](const IrradianceSh& sh, double weight) {
    add_moments(sh, weight, moments);
    Irradiance sum;
    const auto count = static_cast<std::size_t>(sh.count());
    for (std::size_t i = 0; i < count; ++i) sum += sh.c[i] * basis[i];
    out.value += sum * static_cast<float>(weight);
  };
  const Weights& w = query.weights();
  for (std::size_t k = 0; k < w.count; ++k) add(query.node(k).residual_irradiance, w.weight[k]);
  if (surround) add(irradiance_of(surround->seen_from(position)), 1);
  query.lights([&](const LightHere& here) {
    moments.add(here);
    const double c = dot(normalized(vec_cast<double>(here.light.direction)), n);
    const auto rho = static_cast<double>(here.light.angular_radius_rad);
    out.value += here.light.irradiance * static_cast<float>(cap_irradiance(c, rho));
  });
  out.validity = query.stale() ? Validity::stale : Validity::valid;
  out.age = std::max(query.age(), Duration{});
  out.error_bound = static_cast<float>(query.bound(moments));
  out.flags = query.light_flags;
  if (!std::isfinite(out.error_bound)) out.flags.set(Flag::unsure);
  return out;
}

}  // namespace lightwell::field
