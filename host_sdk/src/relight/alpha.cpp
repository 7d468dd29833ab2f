// alpha of equation 1: patterns relative to basis lights.
#include "relight/alpha.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "rays/ray_scene.hpp"
#include "relight/direction_blend.hpp"
#include "relight/emitter.hpp"
#include "relight/subject.hpp"

namespace lightwell {
namespace relight {
namespace {

/// A pattern nearer to a basis light than this share of the light's distance is at its place.
constexpr double kSamePlace = 1e-3;
/// Below this sum of weighted cosines the basis lights do not reach a pixel.
constexpr float kMinCosine = 0.02F;
/// Parts of a mixed pixel count also where the albedo is black, or none was given.
constexpr float kMinAlbedo = 0.05F;
/// Largest ratio of Lambert's cosines.
constexpr float kMaxCosineRatio = 4;

bool is_black(const Irradiance& e) { return !(e.r > 0 || e.g > 0 || e.b > 0); }

/// A point of the subject and the light of a pattern there.
struct LitPoint {
  Vec3f position, origin, normal;  ///< `origin`: for rays.
  std::size_t pixel = 0;           ///< Whose albedo it has.
  Incident pattern;
};

/// The direct light of a pattern at a point, as multiples of the light of up to three basis lights there.
struct Shares {
  std::size_t count = 0;
  std::array<std::size_t, 3> light{};
  std::array<RgbFactor, 3> ratio{};
  Radiance modelled;  ///< In place of them.
};

/// One pattern.
class PatternAlpha {
 public:
  /// `same`: the basis light at its place, if there is one. `rays` may be null if there is one and no pixel is mixed.
  PatternAlpha(const SubjectData& subject, std::span<const BasisLight> basis, const RayScene* rays,
               const BasisSphere& sphere, const PatternLight& light, std::optional<std::size_t> same,
               AlphaSummary& summary)
      : subject_(subject),
        basis_(basis),
        rays_(rays),
        sphere_(sphere),
        pattern_(light),
        same_(same),
        summary_(summary) {}

  [[nodiscard]] Shares at_pixel(std::size_t p) const {
    return shares(
        {subject_.positions[p], subject_.ray_origin(p), subject_.normals[p], p, pattern_.at_pixel(subject_, p)});
  }

  /// Adds up the parts of a mixed pixel: each has a share in a photograph as Lambert's law and its albedo say. Returns
  /// what is modelled.
  template <class Add>
  Radiance mix(std::span<const SubPixel> parts, const Add& add) {
    points_.clear();
    shares_.clear();
    lights_.clear();
    Radiance modelled;
    for (const SubPixel& part : parts) {
      const float size = subject_.pixel_size(part.like);
      points_.push_back({part.position, part.position + part.normal * (SubjectData::kRayOffset_px * size), part.normal,
                         part.like, pattern_.at_point(part.position, 0.25F * size)});
      const Shares& shares_here = shares_.emplace_back(shares(points_.back()));
      modelled += shares_here.modelled * (1 / static_cast<float>(parts.size()));
      for (std::size_t k = 0; k < shares_here.count; ++k)
        if (std::ranges::find(lights_, shares_here.light[k]) == lights_.end()) lights_.push_back(shares_here.light[k]);
    }
    for (const std::size_t light : lights_) add(light, mean_ratio(light));
    return modelled;
  }

 private:
  /// Of the parts of a mixed pixel, weighted by what they show under a basis light.
  [[nodiscard]] RgbFactor mean_ratio(std::size_t light) const {
    RgbFactor sum, weights;
    for (std::size_t s = 0; s < points_.size(); ++s) {
      const Radiance weight = shown(points_[s], light);
      for (int c = 0; c < 3; ++c) {
        weights[c] += weight[c];
        for (std::size_t k = 0; k < shares_[s].count; ++k)
          if (shares_[s].light[k] == light) sum[c] += weight[c] * shares_[s].ratio[k][c];
      }
    }
    for (int c = 0; c < 3; ++c) sum[c] = weights[c] > 0 ? sum[c] / weights[c] : 0;
    return sum;
  }

  /// What a matte surface at a point shows under a basis light.
  [[nodiscard]] Radiance shown(const LitPoint& point, std::size_t light) const {
    const Incident arrives = incident(basis_[light], point.position);
    const float cosine = dot(point.normal, arrives.towards);
    if (!(cosine > 0) || rays_->occluded(point.origin, arrives.towards, arrives.distance)) return {};
    const Albedo& albedo = subject_.albedo[point.pixel];
    return reflected_radiance(arrives.irradiance * cosine,
                              {albedo.r + kMinAlbedo, albedo.g + kMinAlbedo, albedo.b + kMinAlbedo});
  }

  /// Ratio of two irradiances, times `share`.
  [[nodiscard]] RgbFactor ratio(const Irradiance& pattern, const Irradiance& basis, float share) const {
    RgbFactor out;
    bool limited = false;
    for (int c = 0; c < 3; ++c) {
      if (!(pattern[c] > 0)) continue;
      out[c] = share * pattern[c] / basis[c];
      // Otherwise it is too large, or NaN or infinite because the basis light has no irradiance.
      if (out[c] <= AlphaSummary::kMaxAlpha) continue;
      out[c] = basis[c] > 0 ? AlphaSummary::kMaxAlpha : 0;
      limited = true;
    }
    summary_.limited += limited ? 1 : 0;
    return out;
  }

  [[nodiscard]] Shares shares(const LitPoint& point) const {
    if (is_black(point.pattern.irradiance)) return {};
    if (!same_) return blended(point);
    const Irradiance basis = incident(basis_[*same_], point.position).irradiance;
    return {1, {*same_}, {ratio(point.pattern.irradiance, basis, 1)}, {}};
  }

  [[nodiscard]] Shares blended(const LitPoint& point) const {
    const Incident& arrives = point.pattern;
    const float cosine = dot(point.normal, arrives.towards);
    if (!(cosine > 0) || rays_->occluded(point.origin, arrives.towards, arrives.distance)) return {};
    const auto weights = sphere_.at(vec_cast<double>(point.position), vec_cast<double>(pattern_.position()));
    std::array<Incident, 3> lights;
    std::array<bool, 3> reaches{};
    float sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (!(weights.weight[k] > 0)) continue;
      lights[k] = incident(basis_[weights.light[k]], point.position);
      const float there = dot(point.normal, lights[k].towards);
      if (!(there > 0) || rays_->occluded(point.origin, lights[k].towards, lights[k].distance)) continue;
      reaches[k] = true;
      sum += weights.weight[k] * there;
    }
    Shares out;
    if (sum < kMinCosine) {
      out.modelled = reflected_radiance(arrives.irradiance * cosine, subject_.albedo[point.pixel]);
      return out;
    }
    const float scale = std::min(cosine / sum, kMaxCosineRatio);
    for (std::size_t k = 0; k < 3; ++k) {
      if (!reaches[k]) continue;
      out.light[out.count] = weights.light[k];
      out.ratio[out.count++] = ratio(arrives.irradiance, lights[k].irradiance, scale * weights.weight[k]);
    }
    return out;
  }

  const SubjectData& subject_;
  std::span<const BasisLight> basis_;
  const RayScene* rays_;
  const BasisSphere& sphere_;
  PatternSampler pattern_;
  std::optional<std::size_t> same_;
  AlphaSummary& summary_;
  /// Of the mixed pixel in hand.
  std::vector<LitPoint> points_;
  std::vector<Shares> shares_;
  std::vector<std::size_t> lights_;
};

/// Adds patterns to the maps.
class AlphaBuilder {
 public:
  AlphaBuilder(const SubjectData& subject, std::span<const BasisLight> basis, AlphaData& out)
      : subject_(subject), basis_(basis), sphere_(basis, subject.centre), out_(out) {}

  [[nodiscard]] AlphaSummary& summary() { return summary_; }

  Status add(const PatternLight& light) {
    const Vec3d place = light.T_world_light.translation;
    summary_.widest_rad =
        std::max(summary_.widest_rad, sphere_.blend().nearest_rad(normalized(place - sphere_.centre())));
    std::shared_ptr<const RayScene> rays;
    const auto same = same_place(place);
    // Building the scene of rays takes long, and a pattern at a basis light needs none on a depth map.
    if (!same || !subject_.mixed.empty())
      if (Status status = subject_.surface->rays().assign_to(rays); !status.ok()) return status;
    PatternAlpha pattern(subject_, basis_, rays.get(), sphere_, light, same, summary_);
    auto mixed = subject_.mixed.begin();
    for (std::size_t p = 0; p < out_.pixels; ++p) {
      if (!subject_.has_geometry(p)) continue;
      if (mixed != subject_.mixed.end() && mixed->pixel == p) {
        const auto parts = std::span(subject_.sub_pixels).subspan(mixed->first, mixed->count);
        add_modelled(p, pattern.mix(parts, [&](std::size_t l, const RgbFactor& ratio) { add_ratio(l, p, ratio); }));
        ++mixed;
        continue;
      }
      const Shares shares = pattern.at_pixel(p);
      for (std::size_t k = 0; k < shares.count; ++k) add_ratio(shares.light[k], p, shares.ratio[k]);
      add_modelled(p, shares.modelled);
    }
    return {};
  }

 private:
  [[nodiscard]] std::optional<std::size_t> same_place(Vec3d place) const {
    for (std::size_t i = 0; i < basis_.size(); ++i)
      if (basis_[i].distance == LightDistance::finite &&
          length(basis_[i].place - place) <= kSamePlace * length(basis_[i].place - sphere_.centre()))
        return i;
    return std::nullopt;
  }

  void add_modelled(std::size_t pixel, const Radiance& radiance) {
    if (radiance == Radiance{}) return;
    if (out_.modelled.empty()) out_.modelled.assign(out_.pixels, {});
    out_.modelled[pixel] += radiance;
    ++summary_.modelled;
  }

  void add_ratio(std::size_t light, std::size_t pixel, const RgbFactor& ratio) {
    AlphaMap& map = out_.maps[light];
    if (!map.used) {
      map.planes.assign(3 * out_.pixels, 0);
      map.used = true;
    }
    for (int c = 0; c < 3; ++c) map.planes[static_cast<std::size_t>(c) * out_.pixels + pixel] += ratio[c];
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
