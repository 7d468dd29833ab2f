#include "tools/lightwell_eval/ground_truth.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <lightwell/equirect.hpp>
#include <lightwell/fibonacci_lattice.hpp>

namespace lightwell::eval {
namespace {

/// Number of patches around the panorama to which pixels are summed. Irradiance is then exact except where the horizon
/// of a normal crosses a patch; reflections are accurate for a roughness of at least 0.25, whose lobe is 7 degrees
/// wide.
constexpr int kPatchesWide = 256;

double luminance(const sim::Panorama& p, int i, int j) { return p.pixel(i, j).luminance(); }

Vec3d pixel_direction(const sim::Panorama& p, int i, int j) {
  return equirect_direction((i + 0.5) / p.width, (j + 0.5) / p.height);
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

GroundTruth::GroundTruth(std::string name, const sim::Panorama& panorama)
    : name_(std::move(name)), panorama_(panorama) {
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
  if (roughness == 0) {
    const Radiance l = panorama_.radiance(d);
    return {l.r, l.g, l.b};
  }
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

}  // namespace lightwell::eval
