// alpha of equation 1: patterns relative to basis lights.
#include "relight/alpha.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "relight/direction_blend.hpp"
#include "relight/emitter.hpp"
#include "relight/ray_scene.hpp"
#include "relight/subject.hpp"

namespace lightwell {
namespace relight {
namespace {

/// A pattern nearer to a basis light than this share of the light's distance is at its place.
constexpr double kSamePlace = 1e-3;
/// Below this sum of weighted cosines the basis lights do not reach a pixel.
constexpr float kMinCosine = 0.02F;
/// Largest ratio of Lambert's cosines.
constexpr float kMaxCosineRatio = 4;

bool is_black(const Irradiance& e) { return !(e.r > 0 || e.g > 0 || e.b > 0); }

class AlphaBuilder {
 public:
  AlphaBuilder(const SubjectData& subject, std::span<const BasisLight> basis, AlphaData& out)
      : subject_(subject), basis_(basis), sphere_(basis, vec_cast<double>(subject.centre)), out_(out) {}

  [[nodiscard]] AlphaSummary& summary() { return summary_; }

  Status add(const PatternLight& light) {
    const PatternSampler pattern(light);
    const Vec3d place = light.T_world_light.translation;
    summary_.widest_rad = std::max(summary_.widest_rad, nearest_rad(place));
    if (const auto same = same_place(place)) {
      add_at(pattern, *same);
      return {};
    }
    return add_blended(pattern);
  }

 private:
  [[nodiscard]] double nearest_rad(Vec3d place) const {
    return sphere_.blend().nearest_rad(normalized(place - sphere_.centre()));
  }

  [[nodiscard]] std::optional<std::size_t> same_place(Vec3d place) const {
    for (std::size_t i = 0; i < basis_.size(); ++i)
      if (basis_[i].distance == LightDistance::finite &&
          length(basis_[i].place - place) <= kSamePlace * length(basis_[i].place - sphere_.centre()))
        return i;
    return std::nullopt;
  }

  AlphaMap& map_of(std::size_t light) {
    AlphaMap& map = out_.maps[light];
    if (!map.used) {
      map.planes.assign(3 * out_.pixels, 0);
      map.used = true;
    }
    return map;
  }

  /// Adds `share` times the ratio of two irradiances.
  void add_ratio(std::size_t light, std::size_t pixel, const Irradiance& pattern, const Irradiance& basis,
                 float share) {
    AlphaMap& map = map_of(light);
    bool limited = false;
    for (int c = 0; c < 3; ++c) {
      if (!(pattern[c] > 0)) continue;
      float& alpha = map.planes[static_cast<std::size_t>(c) * out_.pixels + pixel];
      alpha += share * pattern[c] / basis[c];
      // Otherwise it is too large, or NaN or infinite because the basis light has no irradiance.
      if (alpha <= AlphaSummary::kMaxAlpha) continue;
      alpha = basis[c] > 0 ? AlphaSummary::kMaxAlpha : 0;
      limited = true;
    }
    summary_.limited += limited ? 1 : 0;
  }

  void add_at(const PatternSampler& pattern, std::size_t light) {
    map_of(light);
    for (std::size_t p = 0; p < out_.pixels; ++p) {
      if (!subject_.has_geometry(p)) continue;
      const Incident arrives = pattern.at_pixel(subject_, p);
      if (is_black(arrives.irradiance)) continue;
      add_ratio(light, p, arrives.irradiance, incident(basis_[light], subject_.positions[p]).irradiance, 1);
    }
  }

  Status add_blended(const PatternSampler& pattern) {
    const auto rays = subject_.surface->rays();
    if (!rays) return rays.status();
    for (std::size_t p = 0; p < out_.pixels; ++p) {
      if (!subject_.has_geometry(p)) continue;
      const Incident arrives = pattern.at_pixel(subject_, p);
      const float cosine = dot(subject_.normals[p], arrives.towards);
      if (is_black(arrives.irradiance) || !(cosine > 0)) continue;
      const Vec3f origin = subject_.ray_origin(p);
      if ((*rays)->occluded(origin, arrives.towards, arrives.distance)) continue;
      blend(**rays, pattern, p, origin, arrives, cosine);
    }
    return {};
  }

  void blend(const RayScene& rays, const PatternSampler& pattern, std::size_t p, Vec3f origin, const Incident& arrives,
             float cosine) {
    const auto weights = sphere_.at(vec_cast<double>(subject_.positions[p]), vec_cast<double>(pattern.position()));
    std::array<Incident, 3> lights;
    std::array<bool, 3> reaches{};
    float sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (!(weights.weight[k] > 0)) continue;
      lights[k] = incident(basis_[weights.light[k]], subject_.positions[p]);
      const float there = dot(subject_.normals[p], lights[k].towards);
      if (!(there > 0) || rays.occluded(origin, lights[k].towards, lights[k].distance)) continue;
      reaches[k] = true;
      sum += weights.weight[k] * there;
    }
    if (sum < kMinCosine) {
      if (out_.modelled.empty()) out_.modelled.assign(out_.pixels, {});
      const Irradiance e = arrives.irradiance * cosine;
      out_.modelled[p] += reflected_radiance(e, subject_.albedo[p]);
      ++summary_.modelled;
      return;
    }
    const float ratio = std::min(cosine / sum, kMaxCosineRatio);
    for (std::size_t k = 0; k < 3; ++k)
      if (reaches[k])
        add_ratio(weights.light[k], p, arrives.irradiance, lights[k].irradiance, ratio * weights.weight[k]);
  }

  const SubjectData& subject_;
  std::span<const BasisLight> basis_;
  BasisSphere sphere_;
  AlphaData& out_;
  AlphaSummary summary_;
};

}  // namespace
}  // namespace relight

AlphaMaps::AlphaMaps() : data_(std::make_unique<relight::AlphaData>()) {}
AlphaMaps::AlphaMaps(AlphaMaps&&) noexcept = default;
AlphaMaps& AlphaMaps::operator=(AlphaMaps&&) noexcept = default;
AlphaMaps::~AlphaMaps() = default;

Result<AlphaSummary> AlphaMaps::compute(const RelightSubject& subject, std::span<const BasisLight> basis,
                                        std::span<const PatternLight> patterns, std::span<const RgbFactor> weights) {
  if (Status status = relight::validate(basis, patterns); !status.ok()) return status;
  if (!weights.empty() && weights.size() != basis.size())
    return invalid_argument("there are " + std::to_string(weights.size()) + " weights for " +
                            std::to_string(basis.size()) + " basis lights");
  for (std::size_t i = 0; i < weights.size(); ++i)
    if (!std::isfinite(weights[i].r + weights[i].g + weights[i].b) ||
        std::min({weights[i].r, weights[i].g, weights[i].b}) < 0)
      return invalid_argument("weight of basis light " + std::to_string(i) + " is negative or not finite");
  relight::AlphaData& data = *data_;
  data.pixels = subject.data().depth.size();
  data.weights.assign(weights.begin(), weights.end());
  data.weights.resize(basis.size());
  data.maps.resize(basis.size());
  for (relight::AlphaMap& map : data.maps) map.used = false;
  data.modelled.clear();
  relight::AlphaBuilder builder(subject.data(), basis, data);
  for (const PatternLight& pattern : patterns)
    if (Status status = builder.add(pattern); !status.ok()) return status;
  builder.summary().without_geometry = subject.pixels_without_geometry();
  return builder.summary();
}

std::size_t AlphaMaps::lights() const { return data_->weights.size(); }

RgbFactor AlphaMaps::at(std::size_t light, std::size_t pixel) const {
  if (!has_map(light) || pixel >= data_->pixels) return {};
  const std::vector<float>& planes = data_->maps[light].planes;
  return {planes[pixel], planes[data_->pixels + pixel], planes[2 * data_->pixels + pixel]};
}

bool AlphaMaps::has_map(std::size_t light) const { return light < data_->maps.size() && data_->maps[light].used; }

}  // namespace lightwell
