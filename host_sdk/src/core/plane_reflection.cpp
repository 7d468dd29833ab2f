#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <lightwell/plane_reflection.hpp>
#include <lightwell/specular_brdf.hpp>

#include "core/gloss_gather.hpp"
#include "core/mesh_arguments.hpp"
#include "core/mirror_image.hpp"

namespace lightwell {
namespace {

constexpr double kMinSize_m = 1e-6, kMaxSize_m = 1e6, kMaxAspect = 1000;
constexpr int kMaxReflectionCell = 16;
/// Vertices beyond this, in texels, are ignored with their triangles, as those of shadows.
constexpr double kMaxCoordinate = 1 << 20;
/// Lowest and farthest eye, texels: floats resolve the geometry between them.
constexpr double kMinEyeHeight = 1e-3, kMaxEyeDistance = 1e7;
/// Largest radiance: sums of it stay finite.
constexpr float kMaxRadiance = 1e30F;
/// Radii of the lobe, texels, between which a texel changes from the mirror image to the sum under the lobe.
constexpr float kMirrorRadius = 0.25F, kLobeRadius = 1.0F;
/// Hidden shares below this do not count as reflection in the summary.
constexpr float kMinHidden = 1e-3F;

constexpr std::uint32_t kNotAdded = 0xffffffff;

/// A vertex of the object, in texels of the grid.
struct PlacedVertex {
  Vec3f position;
  Radiance radiance;
  bool near = false;                ///< Within kMaxCoordinate.
  std::uint32_t added = kNotAdded;  ///< Index among the vertices above the plane.
};

Radiance usable_radiance(Radiance value) {
  for (int c = 0; c < 3; ++c) value[c] = value[c] > 0 ? std::min(value[c], kMaxRadiance) : 0;
  return value;
}

std::size_t texel_index(int column, int row, int columns) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
}

/// The point of the edge from a (below the plane) to b at the plane.
core::MirrorVertex cut(const PlacedVertex& a, const PlacedVertex& b) {
  const float t = a.position.z / (a.position.z - b.position.z);
  core::MirrorVertex out{a.position + (b.position - a.position) * t, a.radiance + (b.radiance - a.radiance) * t};
  out.position.z = 0;
  return out;
}

}  // namespace

Status PlaneGrid::validate() const {
  if (!std::isfinite(centre.x) || !std::isfinite(centre.y)) return invalid_argument("PlaneGrid::centre is not finite");
  for (const double size : {width_m, height_m})
    if (!(size >= kMinSize_m && size <= kMaxSize_m))
      return invalid_argument("the grid is " + std::to_string(width_m) + " x " + std::to_string(height_m) +
                              " m; both must be from 1e-6 to 1e6");
  if (Status s = core::check_range("PlaneGrid::columns", columns, 1, kMaxSide); !s.ok()) return s;
  if (Status s = core::check_range("PlaneGrid::rows", rows, 1, kMaxSide); !s.ok()) return s;
  const double aspect = width_m * rows / (height_m * columns);
  if (!(aspect >= 1 / kMaxAspect && aspect <= kMaxAspect))
    return invalid_argument("a texel of the grid is " + std::to_string(aspect) +
                            " times as wide as high; allowed are 0.001 to 1000");
  return {};
}

Status ReflectionOptions::validate() const {
  if (!(tolerance >= 0.1 && tolerance <= 1))
    return invalid_argument("ReflectionOptions::tolerance is " + std::to_string(tolerance) + "; allowed are 0.1 to 1");
  return core::check_range("ReflectionOptions::cell", cell, 1, kMaxReflectionCell);
}

class PlaneReflector::Impl {
 public:
  explicit Impl(const ReflectionOptions& options)
      : tolerance_(static_cast<float>(options.tolerance)), cell_(options.cell) {}

  /// All arguments are valid, the plane has gloss, and the eye is in front of it.
  void render(const SpecularBrdf& brdf, const PlaneGrid& grid, const RadiantMesh& object, Vec3d eye,
              std::span<Radiance> reflected, std::span<float> hidden, PlaneReflection& about);

 private:
  using Texel = core::GlossGather::Sum;

  void place_grid(const PlaneGrid& grid, Vec3d eye);
  void place_object(const RadiantMesh& object, PlaneReflection& about);
  void add_triangle(const std::array<PlacedVertex*, 3>& corners);
  [[nodiscard]] Vec3f viewer_at(float x, float y) const;
  /// Under the lobe, at a point in texels.
  [[nodiscard]] Texel blurred(float x, float y) const;
  /// At the texel's centre, of the mirror image where that is sharper than a texel.
  [[nodiscard]] Texel shaded(int column, int row) const;
  const Texel& corner(int column, int row);
  [[nodiscard]] Texel interpolated(int column, int row, int step);
  [[nodiscard]] float lobe_radius(const core::MirrorTexel& mirrored) const;
  void find_steps();

  float tolerance_;
  int cell_;
  core::GlossGather gather_;
  core::MirrorImage image_;
  int columns_ = 0, rows_ = 0;
  double texel_m_ = 1;    ///< Length of a texel along X.
  float row_height_ = 1;  ///< In texels along X.
  Pose T_grid_plane_;     ///< Translation in metres.
  Vec3f eye_;             ///< In texels.
  std::vector<PlacedVertex> placed_;
  std::vector<core::MirrorVertex> vertices_;  ///< Of the part above the plane.
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<core::SectionEdge> section_;
  // By texel or cell, rows from -Y.
  std::vector<core::MirrorTexel> mirrored_;
  std::vector<std::uint8_t> steps_;  ///< Of cells: 1, their texels are computed singly, to cell_.
  std::vector<Texel> corners_;       ///< Of texels; hidden < 0: not computed.
  int cell_columns_ = 0, cell_rows_ = 0;
};

void PlaneReflector::Impl::place_grid(const PlaneGrid& grid, Vec3d eye) {
  columns_ = grid.columns;
  rows_ = grid.rows;
  texel_m_ = grid.width_m / grid.columns;
  row_height_ = static_cast<float>(grid.height_m / grid.rows / texel_m_);
  T_grid_plane_ = {{}, {grid.width_m / 2 - grid.centre.x, grid.height_m / 2 - grid.centre.y, 0}};
  Vec3d at = transformed(T_grid_plane_, eye) * (1 / texel_m_);
  const Vec3d middle{0.5 * columns_, 0.5 * rows_ * static_cast<double>(row_height_), 0};
  const Vec3d away = at - middle;
  const double distance = length(away);
  if (!(distance <= kMaxEyeDistance))
    at = middle + normalized(eye - Vec3d{grid.centre.x, grid.centre.y, 0}) * kMaxEyeDistance;
  at.z = std::max(at.z, kMinEyeHeight);
  eye_ = vec_cast<float>(at);
}

void PlaneReflector::Impl::place_object(const RadiantMesh& object, PlaneReflection& about) {
  const Pose T_grid_mesh = compose(T_grid_plane_, core::with_unit_rotation(object.mesh.T_plane_mesh));
  const bool by_vertex = object.per == RadiancePer::vertex;
  placed_.clear();
  for (std::size_t k = 0; k < object.mesh.positions.size(); ++k) {
    const Vec3d p = transformed(T_grid_mesh, vec_cast<double>(object.mesh.positions[k])) * (1 / texel_m_);
    // False for NaN.
    const bool near =
        std::abs(p.x) <= kMaxCoordinate && std::abs(p.y) <= kMaxCoordinate && std::abs(p.z) <= kMaxCoordinate;
    placed_.push_back(
        {vec_cast<float>(p), by_vertex ? usable_radiance(object.radiance[k]) : Radiance{}, near, kNotAdded});
  }
  vertices_.clear();
  triangles_.clear();
  section_.clear();
  const std::span<const std::uint32_t> indices = object.mesh.indices;
  for (std::size_t t = 0; t < indices.size() / 3; ++t) {
    std::array<PlacedVertex*, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) corners[k] = &placed_[indices[3 * t + k]];
    if (!corners[0]->near || !corners[1]->near || !corners[2]->near) {
      ++about.ignored_triangles;
      continue;
    }
    if (by_vertex) {
      add_triangle(corners);
      continue;
    }
    // Triangles of different radiance share no vertex.
    const Radiance radiance = usable_radiance(object.radiance[t]);
    for (PlacedVertex* corner : corners) {
      corner->radiance = radiance;
      corner->added = kNotAdded;
    }
    add_triangle(corners);
  }
}

/// The part of the triangle above the plane.
void PlaneReflector::Impl::add_triangle(const std::array<PlacedVertex*, 3>& corners) {
  std::array<std::uint32_t, 4> polygon{};
  std::size_t count = 0;
  core::SectionEdge crossing;
  for (std::size_t k = 0; k < 3; ++k) {
    PlacedVertex& a = *corners[k];
    const PlacedVertex& b = *corners[(k + 1) % 3];
    if (a.position.z >= 0) {
      if (a.added == kNotAdded) {
        a.added = static_cast<std::uint32_t>(vertices_.size());
        vertices_.push_back({a.position, a.radiance});
      }
      polygon[count++] = a.added;
    }
    if ((a.position.z >= 0) == (b.position.z >= 0)) continue;
    polygon[count++] = static_cast<std::uint32_t>(vertices_.size());
    const bool descends = a.position.z >= 0;
    vertices_.push_back(descends ? cut(b, a) : cut(a, b));
    const Vec3f at = vertices_.back().position;
    if (descends) {
      crossing.from_x = at.x;
      crossing.from_y = at.y;
    } else {
      crossing.to_x = at.x;
      crossing.to_y = at.y;
    }
  }
  if (count == 0) return;
  const bool crosses = std::ranges::any_of(corners, [](const PlacedVertex* corner) { return corner->position.z < 0; });
  if (crosses) section_.push_back(crossing);
  for (std::size_t k = 2; k < count; ++k) triangles_.push_back({polygon[0], polygon[k - 1], polygon[k]});
}

Vec3f PlaneReflector::Impl::viewer_at(float x, float y) const {
  return normalized(Vec3f{eye_.x - x, eye_.y - y, eye_.z});
}

PlaneReflector::Impl::Texel PlaneReflector::Impl::blurred(float x, float y) const {
  return gather_.gather(image_.groups(), x, y, viewer_at(x, y), tolerance_);
}

/// Of a texel of the mirror image.
float PlaneReflector::Impl::lobe_radius(const core::MirrorTexel& mirrored) const {
  return static_cast<float>(SpecularBrdf::half_width_rad(static_cast<double>(gather_.brdf().alpha))) *
         mirrored.distance;
}

PlaneReflector::Impl::Texel PlaneReflector::Impl::shaded(int column, int row) const {
  const float x = static_cast<float>(column) + 0.5F, y = (static_cast<float>(row) + 0.5F) * row_height_;
  const core::MirrorTexel& mirrored = mirrored_[texel_index(column, row, columns_)];
  const Vec3f v = viewer_at(x, y);
  float blur = 1;
  if (mirrored.covered > 0) {
    // On the plane the lobe is longest along the viewer's azimuth.
    blur = std::clamp((lobe_radius(mirrored) / v.z - kMirrorRadius) / (kLobeRadius - kMirrorRadius), 0.0F, 1.0F);
    blur = blur * blur * (3 - 2 * blur);
  }
  Texel out;
  if (blur > 0) {
    out = gather_.gather(image_.groups(), x, y, v, tolerance_);
    out.reflected = out.reflected * blur;
    out.hidden *= blur;
  }
  if (blur < 1) {
    out.reflected += mirrored.radiance * ((1 - blur) * gather_.albedo(v.z));
    out.hidden += mirrored.covered * (1 - blur);
  }
  return out;
}

/// For each cell, how far apart the points are between which its texels are interpolated: no farther than the blur is
/// wide there and in the cells around it.
void PlaneReflector::Impl::find_steps() {
  cell_columns_ = (columns_ + cell_ - 1) / cell_;
  cell_rows_ = (rows_ + cell_ - 1) / cell_;
  steps_.assign(static_cast<std::size_t>(cell_columns_) * static_cast<std::size_t>(cell_rows_),
                static_cast<std::uint8_t>(cell_));
  mirrored_.clear();
  const float longer_side = std::max(1.0F, row_height_);
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      mirrored_.push_back(image_.texel(column, row));
      const core::MirrorTexel& mirrored = mirrored_.back();
      if (mirrored.covered == 0) continue;
      // Across the viewer's azimuth the lobe is narrowest.
      const float cosine =
          viewer_at(static_cast<float>(column) + 0.5F, (static_cast<float>(row) + 0.5F) * row_height_).z;
      const float width = lobe_radius(mirrored) * cosine;
      int step = cell_;
      while (step > 1 && static_cast<float>(step) * longer_side > width) step /= 2;
      const int i = column / cell_, j = row / cell_;
      for (int b = std::max(j - 1, 0); b <= std::min(j + 1, cell_rows_ - 1); ++b)
        for (int a = std::max(i - 1, 0); a <= std::min(i + 1, cell_columns_ - 1); ++a) {
          std::uint8_t& least = steps_[texel_index(a, b, cell_columns_)];
          least = std::min(least, static_cast<std::uint8_t>(step));
        }
    }
}

/// Under the lobe at the corner of a texel, computed once.
const PlaneReflector::Impl::Texel& PlaneReflector::Impl::corner(int column, int row) {
  Texel& out = corners_[texel_index(column, row, columns_ + cell_)];
  if (out.hidden < 0) out = blurred(static_cast<float>(column), static_cast<float>(row) * row_height_);
  return out;
}

/// Between corners that are `step` texels apart.
PlaneReflector::Impl::Texel PlaneReflector::Impl::interpolated(int column, int row, int step) {
  const int i = column % cell_ % step, j = row % cell_ % step;
  const float fx = (static_cast<float>(i) + 0.5F) / static_cast<float>(step);
  const float fy = (static_cast<float>(j) + 0.5F) / static_cast<float>(step);
  Texel out;
  for (int k = 0; k < 4; ++k) {
    const Texel& at = corner(column - i + k % 2 * step, row - j + k / 2 * step);
    const float weight = (k % 2 == 0 ? 1 - fx : fx) * (k / 2 == 0 ? 1 - fy : fy);
    out.reflected += at.reflected * weight;
    out.hidden += at.hidden * weight;
  }
  return out;
}

void PlaneReflector::Impl::render(const SpecularBrdf& brdf, const PlaneGrid& grid, const RadiantMesh& object, Vec3d eye,
                                  std::span<Radiance> reflected, std::span<float> hidden, PlaneReflection& about) {
  gather_.set(brdf);
  place_grid(grid, eye);
  place_object(object, about);
  image_.build({vertices_, triangles_, section_, eye_, columns_, rows_, row_height_});
  find_steps();
  corners_.assign(static_cast<std::size_t>(columns_ + cell_) * static_cast<std::size_t>(rows_ + cell_), {{}, -1});
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      const int step = steps_[texel_index(column / cell_, row / cell_, cell_columns_)];
      const Texel texel = step == 1 ? shaded(column, row) : interpolated(column, row, step);
      // Row 0 of the texture is at the top.
      const std::size_t at = texel_index(column, rows_ - 1 - row, columns_);
      reflected[at] = texel.reflected;
      hidden[at] = std::min(texel.hidden, 1.0F);
      if (texel.hidden > kMinHidden) ++about.texels;
    }
}

Result<PlaneReflector> PlaneReflector::make(const ReflectionOptions& options) {
  if (Status s = options.validate(); !s.ok()) return s;
  return PlaneReflector(std::make_unique<Impl>(options));
}

PlaneReflector::PlaneReflector(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
PlaneReflector::PlaneReflector(PlaneReflector&&) noexcept = default;
PlaneReflector& PlaneReflector::operator=(PlaneReflector&&) noexcept = default;
PlaneReflector::~PlaneReflector() = default;

Result<PlaneReflection> PlaneReflector::render(const PlaneAppearance& plane, const PlaneGrid& grid,
                                               const RadiantMesh& object, Vec3d eye, std::span<Radiance> reflected,
                                               std::span<float> hidden) {
  if (Status s = grid.validate(); !s.ok()) return s;
  if (Status s = core::check_mesh(object.mesh); !s.ok()) return s;
  const bool by_vertex = object.per == RadiancePer::vertex;
  const std::size_t wanted = by_vertex ? object.mesh.positions.size() : object.mesh.indices.size() / 3;
  if (object.radiance.size() != wanted)
    return invalid_argument("RadiantMesh::radiance has " + std::to_string(object.radiance.size()) + " elements; the " +
                            (by_vertex ? "mesh has " + std::to_string(wanted) + " vertices"
                                       : "mesh has " + std::to_string(wanted) + " triangles"));
  if (Status s = core::check_texels("reflected radiance", reflected.size(), grid.columns, grid.rows); !s.ok()) return s;
  if (Status s = core::check_texels("hidden shares", hidden.size(), grid.columns, grid.rows); !s.ok()) return s;
  PlaneReflection about;
  const PlaneInfo& info = plane.info();
  about.validity = info.gloss_alpha ? plane.validity() : Validity::none;
  if (!is_finite(eye) || !(eye.z > 0)) about.validity = Validity::invalid_query;
  if (about.validity != Validity::valid && about.validity != Validity::stale) {
    std::ranges::fill(reflected, Radiance{});
    std::ranges::fill(hidden, 0.0F);
    return about;
  }
  about.f0_assumed = !info.f0.has_value();
  impl_->render({*info.gloss_alpha, info.f0.value_or(SpecularBrdf{}.f0)}, grid, object, eye, reflected, hidden, about);
  return about;
}

}  // namespace lightwell
