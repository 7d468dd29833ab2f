#include "host_sdk/shadow_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include <lightwell/descriptor.hpp>
#include <lightwell/quantile.hpp>

namespace lightwell::test {
namespace {

using reference::V3;

constexpr double kDegree = std::numbers::pi / 180;

Vec3d as_vec(const V3& v) { return {v.x, v.y, v.z}; }

int along(int triangles, double per_square) {
  return std::max(1, static_cast<int>(std::lround(std::sqrt(triangles / per_square))));
}

reference::TriangleMesh make_object(const std::string& object, int triangles, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const V3 at{0.03 * uniform(random), 0.03 * uniform(random), 0};
  if (object == "standing") {
    const int n = along(triangles, 4);
    return reference::make_blob(at + V3{0, 0, 0.04}, 0.04, 0, n, 2 * n);
  }
  if (object == "hovering") {
    const int n = along(triangles, 4);
    return reference::make_blob(at + V3{0, 0, 0.09}, 0.04, 0.25, n, 2 * n);
  }
  if (object == "sunk") {
    const int n = along(triangles, 4);
    return reference::make_blob(at + V3{0, 0, 0.015}, 0.04, 0.25, n, 2 * n);
  }
  if (object == "poles") {
    reference::TriangleMesh out;
    for (int k = 0; k < 5; ++k) {
      const V3 foot{0.06 * uniform(random), 0.06 * uniform(random), 0};
      const V3 head = foot + V3{0.03 * uniform(random), 0.03 * uniform(random), 0.12};
      out =
          reference::joined(std::move(out), reference::make_pole(foot, head, 0.0015, 10, std::max(1, triangles / 100)));
    }
    return out;
  }
  if (object == "leaves") {
    reference::TriangleMesh out;
    for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(triangles); ++k) {
      const V3 middle = at + 0.05 * V3{uniform(random), uniform(random), 1.2 + uniform(random)};
      for (int i = 0; i < 3; ++i)
        out.positions.push_back(middle + 0.002 * V3{uniform(random), uniform(random), uniform(random)});
      out.triangles.push_back({3 * k, 3 * k + 1, 3 * k + 2});
    }
    return out;
  }
  return reference::make_chair(at, 0.06, uniform(random), along(triangles, 72));
}

}  // namespace

const std::vector<std::string>& shadow_objects() {
  static const std::vector<std::string> objects{"standing", "hovering", "sunk", "poles", "chair"};
  return objects;
}

Lighting lighting_of(const std::vector<reference::ShadowLight>& lights, reference::Rgb residual,
                     const Pose& T_lighting_plane) {
  Descriptor d;
  d.units = Units::relative;
  d.T_probe_origin = T_lighting_plane;
  for (const reference::ShadowLight& light : lights) {
    Light out;
    out.direction = vec_cast<float>(rotate(T_lighting_plane.rotation, normalized(as_vec(light.direction))));
    for (int c = 0; c < 3; ++c) out.irradiance[c] = static_cast<float>(light.irradiance[static_cast<std::size_t>(c)]);
    out.angular_radius_rad = static_cast<float>(light.radius_rad);
    out.distance_m = static_cast<float>(light.distance);
    d.lights.push_back(out);
  }
  // A constant is Y_00 times its coefficient; Y_00² = 1 / 4 pi.
  const double k = std::sqrt(4 * std::numbers::pi);
  for (int c = 0; c < 3; ++c) d.radiance.c[0][c] = static_cast<float>(k * residual[static_cast<std::size_t>(c)]);
  return Lighting::of(std::move(d));
}

reference::TriangleMesh make_shadow_object(const std::string& object, int triangles, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  return make_object(object, triangles, random);
}

ShadowCase make_shadow_case(const ShadowCaseOptions& options) {
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  ShadowCase out;
  out.name = options.name;
  out.scene.mesh = make_object(options.object, options.triangles, random);
  double total = 0;
  for (const double radius : options.radii_deg) {
    const double elevation = kDegree * (options.min_elevation_deg +
                                        uniform(random) * (options.max_elevation_deg - options.min_elevation_deg));
    const double azimuth = 2 * std::numbers::pi * uniform(random);
    const double cosine = std::cos(elevation), sine = std::sin(elevation);
    // On the plane, every light has a similar irradiance.
    const double e = (0.5 + uniform(random)) / sine;
    out.scene.lights.push_back({{cosine * std::cos(azimuth), cosine * std::sin(azimuth), sine},
                                kDegree * radius,
                                {e * (0.8 + 0.4 * uniform(random)), e, e * (0.8 + 0.4 * uniform(random))}});
    total += e * sine;
  }
  if (options.radii_deg.empty()) total = 1;
  const double share = options.radii_deg.empty() ? 0.5 : options.residual_share;
  const double l = total * share / (1 - share) / std::numbers::pi;
  const reference::Rgb residual{0.9 * l, l, 1.2 * l};
  if (share > 0) out.scene.residual = [residual](V3) { return residual; };
  out.T_lighting_plane = {Quat{uniform(random), uniform(random), -uniform(random), uniform(random)}.normalized(),
                          {uniform(random), 2 * uniform(random), -uniform(random)}};
  out.lighting = lighting_of(out.scene.lights, residual, out.T_lighting_plane);
  for (const V3& p : out.scene.mesh.positions) out.positions.push_back(vec_cast<float>(as_vec(p)));
  for (const auto& t : out.scene.mesh.triangles) out.indices.insert(out.indices.end(), t.begin(), t.end());
  return out;
}

std::vector<ShadowCaseOptions> shadow_cases(int triangles) {
  std::vector<ShadowCaseOptions> out;
  std::uint64_t seed = 1;
  for (const std::string& object : shadow_objects()) {
    out.push_back({object + ", lights of 0.5 to 10 deg", object, triangles, {0.5, 2, 5, 10}, 20, 80, 0.4, seed++});
    out.push_back({object + ", lights at 4 to 12 deg elevation", object, triangles, {0.5, 2, 5}, 4, 12, 0.4, seed++});
    out.push_back({object + ", residual alone", object, triangles, {}, 0, 0, 1, seed++});
    out.push_back({object + ", lights alone", object, triangles, {1, 10}, 20, 80, 0, seed++});
  }
  return out;
}

ShadowCaseOptions unconnected_case(int triangles) {
  return {"leaves, lights of 0.5 to 10 deg", "leaves", triangles, {0.5, 2, 5, 10}, 20, 80, 0.4, 1};
}

reference::PlaneRectangle rectangle_of(const ShadowReceiver& receiver, int column, int row) {
  const double w = receiver.width_m / receiver.columns, h = receiver.height_m / receiver.rows;
  const double left = column * w - receiver.width_m / 2, top = receiver.height_m / 2 - row * h;
  return {left, top - h, left + w, top};
}

std::vector<TracedTexel> trace_texels(const ShadowCase& test_case, const ShadowReceiver& receiver, int count,
                                      int rays) {
  const reference::ShadowTracer tracer(test_case.scene);
  std::mt19937_64 random(7);
  std::vector<TracedTexel> out;
  for (int n = 0; n < count; ++n) {
    const int column = static_cast<int>(random() % static_cast<std::uint64_t>(receiver.columns));
    const int row = static_cast<int>(random() % static_cast<std::uint64_t>(receiver.rows));
    out.push_back({column, row, tracer.ratio(rectangle_of(receiver, column, row), rays)});
  }
  return out;
}

ShadowErrors shadow_errors(const std::vector<TracedTexel>& truth, const ShadowReceiver& receiver,
                           const std::vector<LightRatio>& ratios) {
  std::vector<double> errors;
  double sum = 0, sum_shadowed = 0;
  int shadowed = 0;
  for (const TracedTexel& texel : truth) {
    const LightRatio ratio = ratios[static_cast<std::size_t>(texel.row * receiver.columns + texel.column)];
    for (int c = 0; c < 3; ++c) {
      const double exact = texel.ratio[static_cast<std::size_t>(c)];
      const double error = std::abs(static_cast<double>(ratio[c]) - exact);
      errors.push_back(error);
      sum += error * error;
      if (exact < 0.995) {
        sum_shadowed += error * error;
        ++shadowed;
      }
    }
  }
  ShadowErrors out;
  out.rms = std::sqrt(sum / static_cast<double>(errors.size()));
  out.rms_shadowed = shadowed > 0 ? std::sqrt(sum_shadowed / shadowed) : 0;
  out.largest = *std::ranges::max_element(errors);
  out.percentile_99 = upper_quantile(errors, 0.99);
  return out;
}

}  // namespace lightwell::test
