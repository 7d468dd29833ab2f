#include "tools/lightwell_eval/balls.hpp"

#include <cmath>
#include <functional>
#include <numbers>

#include <lightwell/cap.hpp>
#include <lightwell/query.hpp>
#include <lightwell/reconstruction.hpp>

namespace lightwell::eval {
namespace {

constexpr int kSize = 48;
/// Perceptual roughness of the matte silver ball of the literature (DiffusionLight-evaluation, matte_silver.py).
constexpr double kSilverRoughness = 0.3271;

struct Pixel {
  Vec3d normal, reflection;
};

const std::vector<Pixel>& ball_pixels() {
  static const std::vector<Pixel> pixels = [] {
    std::vector<Pixel> out;
    for (int j = 0; j < kSize; ++j) {
      for (int i = 0; i < kSize; ++i) {
        const double x = 2 * (i + 0.5) / kSize - 1, y = 1 - 2 * (j + 0.5) / kSize, z2 = 1 - x * x - y * y;
        if (z2 <= 0) continue;
        const Vec3d n{x, y, std::sqrt(z2)}, towards_viewer{0, 0, 1};
        out.push_back({n, n * (2 * dot(n, towards_viewer)) - towards_viewer});
      }
    }
    return out;
  }();
  return pixels;
}

using DirectionFunction = std::function<Color(Vec3d)>;

BallPictures pictures(const DirectionFunction& irradiance, const DirectionFunction& silver,
                      const DirectionFunction& mirror) {
  BallPictures out;
  for (const Pixel& p : ball_pixels()) {
    Color diffuse = irradiance(p.normal);
    for (double& v : diffuse) v *= std::numbers::inv_pi;
    out[0].push_back(diffuse);
    out[1].push_back(silver(p.reflection));
    out[2].push_back(mirror(p.reflection));
  }
  return out;
}

template <class T>
Color color(const Rgb<T>& v) {
  return {v.r, v.g, v.b};
}

/// Radiance of the lights in a direction, each a disc of uniform radiance.
Radiance discs(const Descriptor& d, Vec3d direction) {
  Radiance sum;
  for (const Light& light : d.lights) {
    const double rho = std::max(1e-3, static_cast<double>(light.angular_radius_rad));
    if (dot(vec_cast<double>(light.direction), direction) < std::cos(rho)) continue;
    const auto k = static_cast<float>(1 / cap_vector_irradiance(rho));
    sum += Radiance{light.irradiance.r * k, light.irradiance.g * k, light.irradiance.b * k};
  }
  return sum;
}

}  // namespace

BallPictures ball_pictures(const GroundTruth& truth) {
  return pictures([&](Vec3d n) { return truth.irradiance(n); },
                  [&](Vec3d d) { return truth.radiance(d, kSilverRoughness); },
                  [&](Vec3d d) { return truth.radiance(d, 0); });
}

BallPictures ball_pictures(const Descriptor& d) {
  const GgxLobe lobe(kSilverRoughness);
  const auto silver = lobe.coefficients();
  std::array<double, kMaxBand + 1> mirror;
  mirror.fill(1);
  const RadianceReconstruction reconstruction = reconstruct(d.radiance);
  const bool has_map = d.environment && d.environment->whole();
  const auto rest = [&](const std::array<double, kMaxBand + 1>& factors, Vec3f at, double roughness) {
    return has_map ? environment_radiance(*d.environment, at, static_cast<float>(roughness))
                   : radiance_at(reconstruction, at, roughness, factors);
  };
  return pictures([&](Vec3d n) { return color(irradiance_at(d, vec_cast<float>(n))); },
                  [&](Vec3d v) {
                    const Vec3f at = vec_cast<float>(v);
                    return color(rest(silver, at, kSilverRoughness) + lights_radiance(d.lights, at, lobe));
                  },
                  [&](Vec3d v) { return color(rest(mirror, vec_cast<float>(v), 0) + discs(d, v)); });
}

std::array<double, kBalls> ball_errors(const BallPictures& truth, const BallPictures& estimate) {
  std::array<double, kBalls> out{};
  for (std::size_t b = 0; b < kBalls; ++b) {
    double difference = 0, whole = 0;
    for (std::size_t k = 0; k < truth[b].size(); ++k) {
      for (std::size_t c = 0; c < 3; ++c) {
        const double t = truth[b][k][c], e = estimate[b][k][c];
        difference += (e - t) * (e - t);
        whole += t * t;
      }
    }
    out[b] = whole > 0 ? std::sqrt(difference / whole) : 0;
  }
  return out;
}

}  // namespace lightwell::eval
