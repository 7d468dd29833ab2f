#include "estimate/marker/shading_change.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace lightwell::marker {
namespace {

/// Standard deviation of the ratio of a face's irradiances in two frames of one view. On path-traced pictures the face
/// that deviates most does so by 0.2 to 0.7 %.
constexpr double kFaceSigma = 0.01;
/// The same per rad between two views: the reflection of satin paper changes. 9 % over 0.4 rad were seen.
constexpr double kViewSigma = 0.15;
/// The same of a place of the ground plane in one view: samples are means of 16 points, which the pose displaces.
constexpr double kPlaceSigma = 0.04;
/// Patches are compared if their normals agree within a degree: those of a ball do not turn with it.
constexpr double kMinNormalCosine = 0.99985;
/// Standard deviations beyond which the light has changed: 0.006 % of Gaussian errors.
constexpr double kMaxDeviation = 4;
/// Places that are compared are at most this share of the samples' distance apart, so that texture is the same,
constexpr double kMaxOffset = 0.1;
/// and there are at least so many of them.
constexpr int kMinPlaces = 30;

double relative_variance(const SurfaceSample& s) {
  const double sigma = luminance(s.sigma) / std::max(luminance(s.irradiance), 1e-300);
  return sigma * sigma + kSampleRelativeSigma * kSampleRelativeSigma;
}

}  // namespace

void ShadingChange::clear() {
  patches_.clear();
  first_.clear();
  last_.clear();
}

bool ShadingChange::faces_differ(std::span<const SurfaceSample> samples, SurfaceSample Patch::*before,
                                 double sigma) const {
  struct Face {
    double sum = 0, weight = 0;
  };
  std::map<int, Face> faces;
  for (const SurfaceSample& s : samples) {
    const auto found = patches_.find(s.patch);
    if (found == patches_.end()) continue;
    const SurfaceSample& earlier = found->second.*before;
    if (dot(s.normal, earlier.normal) < kMinNormalCosine) continue;
    const double now = luminance(s.irradiance), then = luminance(earlier.irradiance);
    if (!(now > 0 && then > 0)) continue;
    const double weight = 1 / (relative_variance(s) + relative_variance(earlier));
    Face& face = faces[s.surface];
    face.sum += weight * std::log(now / then), face.weight += weight;
  }
  return std::ranges::any_of(faces, [&](const auto& entry) {
    const Face& face = entry.second;
    return std::abs(face.sum / face.weight) > kMaxDeviation * std::hypot(sigma, std::sqrt(1 / face.weight));
  });
}

ShadingChange::Places ShadingChange::places_of(const Shading& shading, Quat probe_body) {
  Places out;
  if (!shading.ground) return out;
  // Cells of half a step hold one sample at most.
  const double cell = shading.ground->step_m / 2;
  const Quat to_body = probe_body.inverse();
  for (const GroundSample& t : shading.ground->samples) {
    if (!(t.radiance > 0)) continue;
    const Vec3d p = rotate(to_body, t.position);
    const auto index = [&](double x) { return static_cast<int>(std::lround(x / cell)); };
    out.try_emplace({index(p.x), index(p.y), index(p.z)}, Place{p, t.radiance, t.sigma / t.radiance});
  }
  return out;
}

bool ShadingChange::update(const Shading& shading, Quat probe_body, Vec3d view) {
  Places places = places_of(shading, probe_body);
  // Squared deviations of many places: chi square with a mean of their number and twice that variance.
  const auto places_differ = [&](const Places& before) {
    double squares = 0;
    int count = 0;
    for (const auto& [cell, place] : places) {
      const auto found = before.find(cell);
      if (found == before.end()) continue;
      const Place& earlier = found->second;
      if (length(place.position - earlier.position) > kMaxOffset * shading.ground->step_m) continue;
      squares += std::pow(std::log(place.radiance / earlier.radiance), 2) /
                 (kPlaceSigma * kPlaceSigma + place.sigma * place.sigma + earlier.sigma * earlier.sigma);
      ++count;
    }
    return count >= kMinPlaces && squares > count + kMaxDeviation * std::sqrt(2.0 * count);
  };
  std::vector<SurfaceSample> samples = shading.samples;
  for (SurfaceSample& s : samples) s.normal = rotate(probe_body.inverse(), s.normal);
  const double first_sigma = kFaceSigma + (patches_.empty() ? 0 : kViewSigma * angle_between(view, first_view_));
  const bool changed = faces_differ(samples, &Patch::last, kFaceSigma) ||
                       faces_differ(samples, &Patch::first, first_sigma) || places_differ(last_) ||
                       places_differ(first_);
  if (changed) clear();
  if (patches_.empty() && last_.empty()) first_ = places, first_view_ = view;
  for (const SurfaceSample& s : samples) patches_.try_emplace(s.patch, Patch{s, s}).first->second.last = s;
  last_ = std::move(places);
  return changed;
}

}  // namespace lightwell::marker
