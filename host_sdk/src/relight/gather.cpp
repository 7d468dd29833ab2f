#include "relight/gather.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

namespace lightwell::relight {
namespace {

/// A pixel whose similar neighbours have less weight in all is simulated itself.
constexpr float kMinNeighbourWeight = 0.2F;
/// Similarity of normals falls as this power of the cosine.
constexpr int kNormalPower = 4;

std::uint64_t hash(std::uint64_t v) {
  // splitmix64 (Steele, Lea & Flood 2014).
  v += 0x9E3779B97F4A7C15ULL;
  v = (v ^ (v >> 30)) * 0xBF58476D1CE4E5B9ULL;
  v = (v ^ (v >> 27)) * 0x94D049BB133111EBULL;
  return v ^ (v >> 31);
}

double fraction(double v) { return v - std::floor(v); }

/// Cosine-weighted directions around a normal: the R2 sequence (Roberts 2018), rotated for each pixel (Cranley &
/// Patterson 1976), on the disc (Malley's method).
class CosineDirections {
 public:
  CosineDirections(Vec3f normal, std::uint64_t seed, std::size_t pixel)
      : normal_(normal), axes_(tangent_basis(normal)) {
    const std::uint64_t bits = hash(seed ^ hash(pixel));
    shift_ = {static_cast<double>(bits >> 32) * 0x1p-32, static_cast<double>(bits & 0xFFFFFFFF) * 0x1p-32};
  }
  [[nodiscard]] Vec3f operator()(int sample) const {
    const double u = fraction(shift_[0] + 0.7548776662466927 * sample),
                 v = fraction(shift_[1] + 0.5698402909980532 * sample);
    const double r = std::sqrt(u), angle = 2 * std::numbers::pi * v;
    return axes_[0] * static_cast<float>(r * std::cos(angle)) + axes_[1] * static_cast<float>(r * std::sin(angle)) +
           normal_ * static_cast<float>(std::sqrt(1 - u));
  }

 private:
  Vec3f normal_;
  std::array<Vec3f, 2> axes_;
  std::array<double, 2> shift_{};
};

/// Albedo below a surface that reflects a share.
Albedo below_surface(const Albedo& albedo, float share) {
  return {share + (1 - share) * albedo.r, share + (1 - share) * albedo.g, share + (1 - share) * albedo.b};
}

Radiance times(const Radiance& radiance, const Albedo& albedo) {
  return {radiance.r * albedo.r, radiance.g * albedo.g, radiance.b * albedo.b};
}

}  // namespace

DirectLight::DirectLight(const SubjectData& subject, const RayScene& rays, const BasisLight& light)
    : subject_(subject), rays_(rays), basis_(&light) {}

DirectLight::DirectLight(const SubjectData& subject, const RayScene& rays, std::span<const PatternSampler> patterns)
    : subject_(subject), rays_(rays), patterns_(patterns) {}

Irradiance DirectLight::arriving(const Incident& incident, Vec3f origin, Vec3f normal) const {
  const float cosine = dot(normal, incident.towards);
  if (!(cosine > 0) || incident.irradiance == Irradiance{}) return {};
  if (rays_.occluded(origin, incident.towards, incident.distance)) return {};
  return incident.irradiance * cosine;
}

Irradiance DirectLight::at_pixel(std::size_t pixel) const {
  const Vec3f origin = subject_.ray_origin(pixel), &normal = subject_.normals[pixel];
  if (basis_ != nullptr) return arriving(incident(*basis_, subject_.positions[pixel]), origin, normal);
  Irradiance sum;
  for (const PatternSampler& pattern : patterns_) sum += arriving(pattern.at_pixel(subject_, pixel), origin, normal);
  return sum;
}

Irradiance DirectLight::at_hidden(const HiddenPoint& point) const {
  if (basis_ != nullptr) return arriving(incident(*basis_, point.origin), point.origin, point.normal);
  // As wide as a pixel at the subject's mean distance.
  const float width = static_cast<float>(length(subject_.centre - subject_.camera.T_world_camera.translation) /
                                         subject_.camera.focal_px);
  Irradiance sum;
  for (const PatternSampler& pattern : patterns_)
    sum += arriving(pattern.at_point(point.origin, width), point.origin, point.normal);
  return sum;
}

/// Simulated pixels around a pixel, with weights whose sum is at most 1.
struct GatherRays::Neighbours {
  std::array<std::uint32_t, 4> slot{};
  std::array<float, 4> weight{};
  float sum = 0;
};

GatherRays::Neighbours GatherRays::neighbours(std::size_t pixel) const {
  const auto columns = static_cast<std::size_t>(subject_->camera.columns);
  const auto rows = static_cast<std::size_t>(subject_->camera.rows), step = static_cast<std::size_t>(options_.step);
  const std::size_t column = pixel % columns, row = pixel / columns;
  const Vec3f at = subject_->positions[pixel], normal = subject_->normals[pixel];
  const float radius = subject_->pixel_size(pixel) * static_cast<float>(step);
  Neighbours out;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t i = (column / step + k % 2) * step, j = (row / step + k / 2) * step;
    if (i >= columns || j >= rows) continue;
    const std::size_t other = j * columns + i;
    if (!subject_->has_geometry(other) || slots_[other] == kMiss) continue;
    const auto tent = [&](std::size_t a, std::size_t b) {
      return 1 - static_cast<float>(a > b ? a - b : b - a) / static_cast<float>(step);
    };
    const float cosine = std::max(dot(normal, subject_->normals[other]), 0.0F);
    const float off_plane = dot(subject_->facets[pixel], subject_->positions[other] - at) / radius;
    out.slot[k] = slots_[other];
    out.weight[k] = tent(i, column) * tent(j, row) * std::pow(cosine, static_cast<float>(kNormalPower)) *
                    std::exp(-off_plane * off_plane);
    out.sum += out.weight[k];
  }
  return out;
}

void GatherRays::choose_pixels() {
  const auto columns = static_cast<std::size_t>(subject_->camera.columns),
             step = static_cast<std::size_t>(options_.step);
  const std::size_t count = subject_->depth.size();
  slots_.assign(count, kMiss);
  const auto choose = [&](std::size_t p) {
    slots_[p] = static_cast<std::uint32_t>(pixels_.size());
    pixels_.push_back(static_cast<std::uint32_t>(p));
  };
  for (std::size_t p = 0; p < count; ++p)
    if (subject_->has_geometry(p) && p % columns % step == 0 && p / columns % step == 0) choose(p);
  // neighbours() looks at grid pixels alone, so that the order of these does not matter.
  for (std::size_t p = 0; p < count; ++p)
    if (subject_->has_geometry(p) && slots_[p] == kMiss && neighbours(p).sum < kMinNeighbourWeight) choose(p);
}

std::uint32_t GatherRays::end_of(Vec3f at, Vec3f direction, const RayScene::Hit& hit) {
  const auto seen = subject_->project(at);
  const bool faces_pixel =
      seen && subject_->has_geometry(seen->pixel) && dot(subject_->facets[seen->pixel], direction) < 0;
  if (subject_->surface->extent() == SurfaceExtent::seen_side)
    // Its triangles have their corners at pixels; from behind there is nothing.
    return faces_pixel ? static_cast<std::uint32_t>(seen->pixel) : kMiss;
  if (faces_pixel && subject_->is_near(at, *seen)) return static_cast<std::uint32_t>(seen->pixel);
  const float offset = 1e-3F * length(at - vec_cast<float>(subject_->camera.T_world_camera.translation));
  hidden_.push_back({at + hit.normal * offset, hit.normal});
  return static_cast<std::uint32_t>(subject_->depth.size() + hidden_.size() - 1);
}

void GatherRays::cast_from(const RayScene& rays, std::size_t pixel) {
  const CosineDirections directions(subject_->normals[pixel], options_.seed, pixel);
  const Vec3f origin = subject_->ray_origin(pixel);
  for (int s = 0; s < options_.samples; ++s) {
    const Vec3f direction = directions(s);
    std::uint32_t end = kMiss;
    // A shading normal leans: directions into the surface see nothing.
    if (dot(direction, subject_->facets[pixel]) > 0)
      if (const auto hit = rays.first_hit(origin, direction))
        end = end_of(origin + direction * hit->distance, direction, *hit);
    ends_.push_back(end);
  }
}

Result<GatherRays> GatherRays::cast(const SubjectData& subject, const RayScene& rays, const IndirectOptions& options) {
  GatherRays out(subject, options);
  out.choose_pixels();
  const std::size_t count = out.pixels_.size() * static_cast<std::size_t>(options.samples);
  if (count > kMaxRays)
    return Status(StatusCode::resource_exhausted,
                  std::to_string(out.pixels_.size()) + " simulated pixels with " + std::to_string(options.samples) +
                      " samples each are too many: take fewer samples or a larger step");
  out.ends_.reserve(count);
  for (const std::uint32_t pixel : out.pixels_) out.cast_from(rays, pixel);
  return out;
}

Radiance GatherRays::mean(std::span<const Radiance> radiosity, std::size_t slot) const {
  const auto samples = static_cast<std::size_t>(options_.samples);
  Radiance sum;
  for (const std::uint32_t end : std::span(ends_).subspan(slot * samples, samples))
    if (end != kMiss) sum += radiosity[end];
  return sum * (1 / static_cast<float>(samples));
}

void GatherRays::simulate(const DirectLight& light, std::vector<Radiance>& out) const {
  const std::size_t count = subject_->depth.size();
  std::vector<Albedo> reflectance;
  reflectance.reserve(count);
  for (const Albedo& albedo : subject_->albedo)
    reflectance.push_back(below_surface(albedo, options_.surface_reflectance));
  const Albedo hidden_reflectance = below_surface(subject_->mean_albedo, options_.surface_reflectance);
  std::vector<Radiance> direct(count + hidden_.size());
  for (std::size_t p = 0; p < count; ++p)
    if (subject_->has_geometry(p)) direct[p] = reflected_radiance(light.at_pixel(p), reflectance[p]);
  for (std::size_t k = 0; k < hidden_.size(); ++k)
    direct[count + k] = reflected_radiance(light.at_hidden(hidden_[k]), hidden_reflectance);
  out.assign(count, {});
  std::vector<Radiance> radiosity = direct, gathered(pixels_.size());
  for (int bounce = 0; bounce < options_.bounces; ++bounce) {
    for (std::size_t slot = 0; slot < pixels_.size(); ++slot) gathered[slot] = mean(radiosity, slot);
    for (std::size_t p = 0; p < count; ++p) {
      if (!subject_->has_geometry(p)) continue;
      Radiance around;
      if (slots_[p] != kMiss) {
        around = gathered[slots_[p]];
      } else {
        const Neighbours near_by = neighbours(p);
        for (std::size_t k = 0; k < 4; ++k) around += gathered[near_by.slot[k]] * (near_by.weight[k] / near_by.sum);
      }
      // Cosine-weighted samples: irradiance is pi times their mean, reflected radiance albedo / pi of that.
      out[p] = times(around, reflectance[p]);
      radiosity[p] = direct[p] + out[p];
    }
  }
}

}  // namespace lightwell::relight
