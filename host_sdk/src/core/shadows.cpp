#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <lightwell/cap.hpp>
#include <lightwell/shadows.hpp>

#include "core/coverage_grid.hpp"
#include "core/light_samples.hpp"
#include "core/mesh_arguments.hpp"
#include "core/mesh_topology.hpp"
#include "core/occluder.hpp"

namespace lightwell {
namespace {

constexpr int kMaxSamples = 1024;
constexpr int kMaxCell = 16;
/// Samples of a light for each texel of the width of its penumbra, and at least. Coverage is exact in area, so that the
/// edges of neighbouring samples merge where they are a texel or two apart.
constexpr double kSamplesPerTexel = 2.0;
constexpr int kMinSamples = 6;
/// A near light illuminates what is below this share of its height: what is higher projects to infinity.
constexpr double kCeiling = 0.98;
constexpr float kNoCeiling = std::numeric_limits<float>::max();

/// Irradiance of which nothing is negative, NaN or infinite.
Irradiance cleaned(Irradiance e) {
  for (int c = 0; c < 3; ++c)
    if (!(e[c] > 0) || !std::isfinite(e[c])) e[c] = 0;
  return e;
}

}  // namespace

Status ShadowReceiver::validate() const {
  if (!core::is_usable(T_lighting_plane))
    return invalid_argument("ShadowReceiver::T_lighting_plane is not finite, or its rotation is zero");
  for (const double size : {width_m, height_m})
    if (!(size > 0) || !std::isfinite(size))
      return invalid_argument("the receiver is " + std::to_string(width_m) + " x " + std::to_string(height_m) +
                              " m; both must be above 0 and finite");
  if (Status s = core::check_range("ShadowReceiver::columns", columns, 1, kMaxSide); !s.ok()) return s;
  return core::check_range("ShadowReceiver::rows", rows, 1, kMaxSide);
}

Status ShadowOptions::validate() const {
  if (Status s = core::check_range("ShadowOptions::light_samples", light_samples, 1, kMaxSamples); !s.ok()) return s;
  if (Status s = core::check_range("ShadowOptions::residual_directions", residual_directions, 1, kMaxSamples); !s.ok())
    return s;
  return core::check_range("ShadowOptions::residual_cell", residual_cell, 1, kMaxCell);
}

class ShadowCaster::Impl {
 public:
  explicit Impl(const ShadowOptions& options) : options_(options), hemisphere_(options.residual_directions) {
    const auto samples = static_cast<std::size_t>(options.light_samples);
    lights_.reserve(kMaxLights);
    // A light that is clipped by the horizon may get a few more than it is asked for.
    samples_.reserve(2 * samples);
    points_.reserve(std::max(2 * samples, static_cast<std::size_t>(options.residual_directions)));
  }

  ShadowSummary cast(const Lighting& lighting, const ShadowReceiver& receiver, const ShadowMesh& mesh,
                     std::span<LightRatio> ratios);

 private:
  /// A light as the plane receives it.
  struct ReceivedLight {
    Vec3d direction;  ///< Unit, in the plane's frame.
    double radius_rad = 0;
    Irradiance irradiance;  ///< Of the plane, without the object; of a near light at the origin, normal incidence.
    bool near = false;
    Vec3d position;         ///< Of a near light, in the plane's frame.
    double distance_m = 0;  ///< Of a near light, from the origin.
    double radius_m = 0;    ///< Of a near light.
  };

  void place_receiver(const ShadowReceiver& receiver, const ShadowMesh& mesh);
  [[nodiscard]] Vec3d in_texels(Vec3d p) const;
  [[nodiscard]] core::LightPoint distant_point(Vec3d direction) const;
  [[nodiscard]] core::LightPoint near_point(Vec3d position) const;
  void receive_lights(const Lighting& lighting);
  void receive_residual(const Lighting& lighting);
  void build_occluder(float ceiling);
  int sample_light(const ReceivedLight& light);
  [[nodiscard]] int sample_count(double height, double radius_rad, double cosine) const;
  template <class Weights>
  void add_samples(core::CoverageGrid& grid, const Weights& weights);
  /// The irradiance of a texel by a near light, relative to that at the origin at normal incidence.
  [[nodiscard]] double near_factor(const ReceivedLight& light, int column, int row) const;
  void lose_light(const ReceivedLight& light);
  void lose_residual();
  void write(std::span<LightRatio> ratios) const;

  ShadowOptions options_;
  core::HemisphereSampler hemisphere_;
  core::MeshTopology topology_;
  core::Occluder occluder_;
  core::CoverageGrid light_grid_, residual_grid_;
  std::vector<Vec3f> vertices_;  ///< In texel space.
  std::vector<ReceivedLight> lights_;
  std::vector<core::LightSample> samples_;
  std::vector<core::LightPoint> points_;
  std::span<const core::HemisphereSample> residual_;
  Irradiance distant_;  ///< Of the plane, from distant lights and residual, without the object.
  Irradiance residual_irradiance_;
  std::array<std::vector<float>, 3> lost_;  ///< Irradiance that the object takes, by texel.
  std::array<std::vector<float>, 3>
      nearby_;                   ///< Irradiance of near lights without the object; empty if there are none.
  std::vector<double> factors_;  ///< near_factor() of the texels of a row.
  Pose T_plane_lighting_;
  ShadowReceiver receiver_;
  double columns_per_m_ = 0, rows_per_m_ = 0;
  float ceiling_ = 0;  ///< Of the occluder as it was built last; 0 if not from these vertices.
};

Vec3d ShadowCaster::Impl::in_texels(Vec3d p) const {
  return {receiver_.columns / 2.0 + p.x * columns_per_m_, receiver_.rows / 2.0 - p.y * rows_per_m_,
          p.z * columns_per_m_};
}

core::LightPoint ShadowCaster::Impl::distant_point(Vec3d direction) const {
  const Vec3d d{direction.x, -direction.y * rows_per_m_ / columns_per_m_, direction.z};
  const Vec3f p = vec_cast<float>(d);
  return {p.x, p.y, p.z, 0};
}

core::LightPoint ShadowCaster::Impl::near_point(Vec3d position) const {
  const Vec3f p = vec_cast<float>(in_texels(position));
  return {p.x, p.y, p.z, 1};
}

void ShadowCaster::Impl::place_receiver(const ShadowReceiver& receiver, const ShadowMesh& mesh) {
  receiver_ = receiver;
  T_plane_lighting_ = inverse(core::with_unit_rotation(receiver.T_lighting_plane));
  columns_per_m_ = receiver.columns / receiver.width_m;
  rows_per_m_ = receiver.rows / receiver.height_m;
  topology_.update(mesh.positions, mesh.indices);
  const Pose T_plane_mesh = core::with_unit_rotation(mesh.T_plane_mesh);
  vertices_.resize(mesh.positions.size());
  for (std::size_t i = 0; i < vertices_.size(); ++i)
    vertices_[i] = vec_cast<float>(in_texels(transformed(T_plane_mesh, vec_cast<double>(mesh.positions[i]))));
  const std::size_t texels = static_cast<std::size_t>(receiver.columns) * static_cast<std::size_t>(receiver.rows);
  for (std::vector<float>& plane : lost_) plane.assign(texels, 0.0F);
  factors_.resize(static_cast<std::size_t>(receiver.columns));
}

void ShadowCaster::Impl::receive_lights(const Lighting& lighting) {
  lights_.clear();
  distant_ = {};
  bool any_near = false;
  for (const Light& light : lighting.lights()) {
    const Irradiance e = cleaned(light.irradiance);
    ReceivedLight out;
    out.direction = rotate(T_plane_lighting_.rotation, lightwell::normalized(vec_cast<double>(light.direction)));
    out.radius_rad = std::clamp<double>(light.angular_radius_rad, 0, std::numbers::pi / 2);
    if (!(e.luminance() > 0) || !std::isfinite(out.radius_rad) || out.direction == Vec3d{}) continue;
    const std::optional<Vec3d> position = lighting.position(light);
    if (position) out.position = transformed(T_plane_lighting_, *position);
    if (position && is_finite(out.position)) {
      out.near = true;
      out.distance_m = light.distance_m;
      out.radius_m = out.distance_m * std::sin(out.radius_rad);
      out.irradiance = e;
      if (!(out.position.z > 0)) continue;
    } else {
      out.irradiance = e * static_cast<float>(cap_irradiance(out.direction.z, out.radius_rad));
      if (!(out.irradiance.luminance() > 0)) continue;
      distant_ += out.irradiance;
    }
    any_near = any_near || out.near;
    lights_.push_back(out);
  }
  for (std::vector<float>& plane : nearby_) plane.assign(any_near ? lost_[0].size() : 0, 0.0F);
}

void ShadowCaster::Impl::receive_residual(const Lighting& lighting) {
  const Quat to_lighting = T_plane_lighting_.rotation.inverse();
  residual_ =
      hemisphere_.sample([&](Vec3d d) { return lighting.radiance(vec_cast<float>(rotate(to_lighting, d)), 0).value; });
  residual_irradiance_ = {};
  for (const core::HemisphereSample& s : residual_) residual_irradiance_ += s.irradiance;
  distant_ += residual_irradiance_;
}

void ShadowCaster::Impl::build_occluder(float ceiling) {
  if (ceiling != ceiling_) occluder_.build(topology_, vertices_, ceiling);
  ceiling_ = ceiling;
}

int ShadowCaster::Impl::sample_count(double height, double radius_rad, double cosine) const {
  // Length of the penumbra on the plane, along the light.
  const double texels = 2 * std::tan(std::min(radius_rad, 1.5)) * height / std::max(cosine * cosine, 1e-4);
  // The least also where that is NaN, from a receiver so large that its positions overflow.
  const double count = std::max<double>(kMinSamples, std::ceil(texels * kSamplesPerTexel));
  return static_cast<int>(std::min<double>(count, options_.light_samples));
}

/// Samples the light over `samples_` and `points_`, and builds the occluder that it meets. Returns the number.
int ShadowCaster::Impl::sample_light(const ReceivedLight& light) {
  build_occluder(kNoCeiling);
  const double top = occluder_.top();
  if (light.near) {
    const Vec3d centre = vec_cast<double>(occluder_.centre());
    const Vec3d target{(centre.x - receiver_.columns / 2.0) / columns_per_m_,
                       (receiver_.rows / 2.0 - centre.y) / rows_per_m_, centre.z / columns_per_m_};
    const Vec3d to_light = light.position - target;
    const double distance = std::max(length(to_light), 1e-9);
    const double radius = std::asin(std::min(light.radius_m / distance, 1.0));
    const double cosine = std::clamp(to_light.z / distance, 0.05, 1.0);
    core::sample_near_light(light.position, light.radius_m, target, sample_count(top, radius, cosine), samples_);
    double lowest = std::numeric_limits<double>::infinity();
    for (const core::LightSample& s : samples_) lowest = std::min(lowest, s.towards.z);
    const double ceiling = kCeiling * lowest * columns_per_m_;
    if (ceiling < top) build_occluder(static_cast<float>(ceiling));
  } else {
    core::sample_cap(light.direction, light.radius_rad, sample_count(top, light.radius_rad, light.direction.z),
                     samples_);
  }
  points_.clear();
  for (const core::LightSample& s : samples_)
    points_.push_back(light.near ? near_point(s.towards) : distant_point(s.towards));
  return static_cast<int>(samples_.size());
}

template <class Weights>
void ShadowCaster::Impl::add_samples(core::CoverageGrid& grid, const Weights& weights) {
  for (std::size_t first = 0; first < points_.size(); first += core::kMaxBatch) {
    const std::size_t count = std::min(core::kMaxBatch, points_.size() - first);
    const auto silhouettes = occluder_.silhouettes(std::span(points_).subspan(first, count));
    for (std::size_t k = 0; k < count; ++k)
      grid.add(occluder_, silhouettes, points_[first + k], static_cast<unsigned>(k), weights(first + k));
  }
}

double ShadowCaster::Impl::near_factor(const ReceivedLight& light, int column, int row) const {
  const double x = (column + 0.5 - receiver_.columns / 2.0) / columns_per_m_,
               y = (receiver_.rows / 2.0 - row - 0.5) / rows_per_m_;
  const Vec3d to_light = light.position - Vec3d{x, y, 0};
  // A sphere above the horizon: cosine over the squared distance, exactly. Inside of the light it would not end.
  const double r2 = std::max({dot(to_light, to_light), light.radius_m * light.radius_m, 1e-12});
  return light.distance_m * light.distance_m / r2 * (to_light.z / std::sqrt(r2));
}

void ShadowCaster::Impl::lose_light(const ReceivedLight& light) {
  for (int row = 0; row < receiver_.rows; ++row) {
    const std::span<const float> occlusion = light_grid_.row(0, row);
    const std::size_t at = static_cast<std::size_t>(row) * occlusion.size();
    if (light.near)
      for (std::size_t x = 0; x < factors_.size(); ++x) factors_[x] = near_factor(light, static_cast<int>(x), row);
    for (int c = 0; c < 3; ++c) {
      float* const lost = lost_[static_cast<std::size_t>(c)].data() + at;
      const float e = light.irradiance[c];
      if (!light.near) {
        for (std::size_t x = 0; x < occlusion.size(); ++x) lost[x] += e * occlusion[x];
        continue;
      }
      float* const nearby = nearby_[static_cast<std::size_t>(c)].data() + at;
      for (std::size_t x = 0; x < occlusion.size(); ++x) {
        const auto here = static_cast<float>(e * factors_[x]);
        nearby[x] += here;
        lost[x] += here * occlusion[x];
      }
    }
  }
}

void ShadowCaster::Impl::lose_residual() {
  const int columns = residual_grid_.columns(), rows = residual_grid_.rows();
  const double cells = 1.0 / options_.residual_cell;
  const auto neighbours = [&](int i, int count, int& first, int& second) {
    const double at = std::clamp((i + 0.5) * cells - 0.5, 0.0, count - 1.0);
    first = static_cast<int>(at);
    second = std::min(first + 1, count - 1);
    return static_cast<float>(at - first);
  };
  for (int row = 0; row < receiver_.rows; ++row) {
    int top = 0, bottom = 0;
    const float down = neighbours(row, rows, top, bottom);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto upper = residual_grid_.row(c, top), lower = residual_grid_.row(c, bottom);
      float* const lost = lost_[c].data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(receiver_.columns);
      if (options_.residual_cell == 1) {
        for (std::size_t x = 0; x < upper.size(); ++x) lost[x] += upper[x];
        continue;
      }
      for (int x = 0; x < receiver_.columns; ++x) {
        int left = 0, right = 0;
        const float along = neighbours(x, columns, left, right);
        const auto l = static_cast<std::size_t>(left), r = static_cast<std::size_t>(right);
        const float a = upper[l] + along * (upper[r] - upper[l]), b = lower[l] + along * (lower[r] - lower[l]);
        lost[x] += a + down * (b - a);
      }
    }
  }
}

void ShadowCaster::Impl::write(std::span<LightRatio> ratios) const {
  for (int c = 0; c < 3; ++c) {
    const std::vector<float>&lost = lost_[static_cast<std::size_t>(c)], &nearby = nearby_[static_cast<std::size_t>(c)];
    for (std::size_t i = 0; i < ratios.size(); ++i) {
      const float total = distant_[c] + (nearby.empty() ? 0.0F : nearby[i]);
      // Sums of huge irradiances may overflow.
      const bool known = total > 0 && std::isfinite(total) && std::isfinite(lost[i]);
      ratios[i][c] = known ? std::clamp(1 - lost[i] / total, 0.0F, 1.0F) : 1.0F;
    }
  }
}

ShadowSummary ShadowCaster::Impl::cast(const Lighting& lighting, const ShadowReceiver& receiver, const ShadowMesh& mesh,
                                       std::span<LightRatio> ratios) {
  place_receiver(receiver, mesh);
  receive_lights(lighting);
  receive_residual(lighting);
  ceiling_ = 0;
  ShadowSummary summary;
  for (const ReceivedLight& light : lights_) {
    light_grid_.reset(receiver.columns, receiver.rows, 1, 1);
    summary.directions += sample_light(light);
    add_samples(light_grid_, [&](std::size_t k) { return std::array{static_cast<float>(samples_[k].weight)}; });
    lose_light(light);
  }
  summary.lights = static_cast<int>(lights_.size());
  summary.no_light = lights_.empty() && !(distant_.r > 0 || distant_.g > 0 || distant_.b > 0);
  build_occluder(kNoCeiling);
  if (residual_irradiance_.r > 0 || residual_irradiance_.g > 0 || residual_irradiance_.b > 0) {
    points_.clear();
    for (const core::HemisphereSample& s : residual_) points_.push_back(distant_point(s.towards));
    summary.directions += static_cast<int>(points_.size());
    const int cell = options_.residual_cell;
    residual_grid_.reset((receiver.columns + cell - 1) / cell, (receiver.rows + cell - 1) / cell,
                         1.0F / static_cast<float>(cell), 3);
    add_samples(residual_grid_, [&](std::size_t k) {
      const Irradiance e = residual_[k].irradiance;
      return std::array{e.r, e.g, e.b};
    });
    lose_residual();
  }
  summary.ignored_triangles = occluder_.ignored_triangles();
  write(ratios);
  return summary;
}

ShadowCaster::ShadowCaster(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ShadowCaster::ShadowCaster(ShadowCaster&&) noexcept = default;
ShadowCaster& ShadowCaster::operator=(ShadowCaster&&) noexcept = default;
ShadowCaster::~ShadowCaster() = default;

Result<ShadowCaster> ShadowCaster::make(const ShadowOptions& options) {
  if (Status s = options.validate(); !s.ok()) return s;
  return ShadowCaster(std::make_unique<Impl>(options));
}

Result<Answer<ShadowSummary>> ShadowCaster::cast(const Lighting& lighting, const ShadowReceiver& receiver,
                                                 const ShadowMesh& mesh, std::span<LightRatio> ratios) {
  if (Status s = receiver.validate(); !s.ok()) return s;
  if (Status s = core::check_mesh(mesh); !s.ok()) return s;
  if (Status s = core::check_texels("ratios", ratios.size(), receiver.columns, receiver.rows); !s.ok()) return s;
  Answer<ShadowSummary> out;
  out.validity = lighting.validity();
  out.age = lighting.age();
  out.error_bound = lighting.descriptor().bound.total;
  out.flags = lighting.descriptor().flags;
  out.value = impl_->cast(lighting, receiver, mesh, ratios);
  return out;
}

}  // namespace lightwell
