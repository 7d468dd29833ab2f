#include "tools/lightwell_eval/ground_truth.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include <lightwell/cap.hpp>
#include <lightwell/equirect.hpp>
#include <lightwell/query.hpp>
#include <lightwell/reconstruction.hpp>

namespace lightwell::eval {
namespace {

/// Number of patches around the panorama to which pixels are summed. Irradiance is then exact except where the horizon
/// of a normal crosses a patch; reflections for a roughness of at least 0.25 (a lobe of 7 degrees) are accurate.
constexpr int kPatchesWide = 256;

double luminance(const sim::Panorama& p, int i, int j) { return p.pixel(i, j).luminance(); }

Vec3d pixel_direction(const sim::Panorama& p, int i, int j) {
  return equirect_direction((i + 0.5) / p.width, (j + 0.5) / p.height);
}

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

const std::vector<Vec3d>& truth_normals() {
  static const std::vector<Vec3d> normals = [] {
    constexpr int kNormals = 2048;
    std::vector<Vec3d> all;
    for (int i = 0; i < kNormals; ++i) all.push_back(fibonacci_direction(i, kNormals));
    return all;
  }();
  return normals;
}

GroundTruth::GroundTruth(sim::Panorama panorama) : panorama_(std::move(panorama)) {
  const int edge = std::max(1, panorama_.width / kPatchesWide);
  for (int y = 0; y < panorama_.height; y += edge) {
    for (int x = 0; x < panorama_.width; x += edge) {
      Patch& patch = patches_.emplace_back();
      for (int j = y; j < std::min(y + edge, panorama_.height); ++j) {
        const double omega = equirect_solid_angle(j, panorama_.width, panorama_.height);
        for (int i = x; i < std::min(x + edge, panorama_.width); ++i) {
          const Vec3d d = pixel_direction(panorama_, i, j);
          const Radiance l = panorama_.pixel(i, j);
          for (int c = 0; c < 3; ++c) {
            patch.vector[static_cast<std::size_t>(c)] += d * (omega * l[c]);
            patch.sum[static_cast<std::size_t>(c)] += omega * l[c];
          }
          patch.direction += d * omega;
          patch.solid_angle += omega;
        }
      }
      patch.direction = normalized(patch.direction);
    }
  }
  for (const Vec3d& n : truth_normals()) irradiances_.push_back(irradiance(n));
  find_brightest();
}

Color GroundTruth::irradiance(Vec3d n) const {
  Color sum{};
  for (const Patch& patch : patches_)
    for (std::size_t c = 0; c < 3; ++c) sum[c] += std::max(0.0, dot(n, patch.vector[c]));
  return sum;
}

Color GroundTruth::radiance(Vec3d d, double roughness) const {
  if (roughness == 0) return color(panorama_.radiance(d));
  // GgxLobe::value without its constant factor, which cancels in the division.
  const double a2 = std::pow(roughness, 4), slope = 0.5 * (1 - a2);
  Color sum{};
  double whole = 0;
  for (const Patch& patch : patches_) {
    const double x = dot(d, patch.direction);
    if (x <= 0) continue;
    const double inverse = 1 / (a2 + slope * (1 - x)), weight = x * inverse * inverse;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * patch.sum[c];
    whole += weight * patch.solid_angle;
  }
  for (double& v : sum) v /= whole;
  return sum;
}

void GroundTruth::find_brightest() {
  const int width = panorama_.width, height = panorama_.height;
  double mean = 0, peak = 0;
  int peak_i = 0, peak_j = 0;
  for (int j = 0; j < height; ++j) {
    const double omega = equirect_solid_angle(j, width, height);
    for (int i = 0; i < width; ++i) {
      const double l = luminance(panorama_, i, j);
      mean += omega * l / (4 * std::numbers::pi);
      if (l > peak) {
        peak = l;
        peak_i = i;
        peak_j = j;
      }
    }
  }
  if (!(peak > 0)) return;
  peak_to_mean_ = peak / mean;
  std::vector<char> taken(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::vector<std::pair<int, int>> open;
  const auto visit = [&](int i, int j) {
    if (j < 0 || j >= height) {  // Across the pole to the opposite meridian.
      j = std::clamp(j, 0, height - 1);
      i += width / 2;
    }
    i = (i + width) % width;
    char& seen = taken[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i)];
    if (seen != 0 || luminance(panorama_, i, j) < 0.5 * peak) return;
    seen = 1;
    open.emplace_back(i, j);
  };
  visit(peak_i, peak_j);
  Vec3d sum;
  while (!open.empty()) {
    const auto [i, j] = open.back();
    open.pop_back();
    sum += pixel_direction(panorama_, i, j) * (luminance(panorama_, i, j) * equirect_solid_angle(j, width, height));
    for (int y = j - 1; y <= j + 1; ++y)
      for (int x = i - 1; x <= i + 1; ++x) visit(x, y);
  }
  brightest_ = normalized(sum);
}

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

RelativeError relative_error(std::span<const Color> truth, std::span<const Color> estimate) {
  double difference = 0, whole = 0, largest = 0;
  for (std::size_t k = 0; k < truth.size(); ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      const double t = truth[k][c], error = estimate[k][c] - t;
      difference += error * error;
      whole += t * t;
      largest = std::max(largest, std::abs(error));
    }
  return {std::sqrt(difference / whole), largest / std::sqrt(whole / (3.0 * static_cast<double>(truth.size())))};
}

std::array<double, kBalls> ball_errors(const BallPictures& truth, const BallPictures& estimate) {
  std::array<double, kBalls> out{};
  for (std::size_t b = 0; b < kBalls; ++b) {
    const double rms = relative_error(truth[b], estimate[b]).rms;
    out[b] = std::isfinite(rms) ? rms : 0;  // A black ball has no relative error.
  }
  return out;
}

}  // namespace lightwell::eval
