#include "core/mirror_image.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

namespace lightwell::core {
namespace {

/// Grids with more texels along a side have one pixel for each, others two.
constexpr int kMaxDividedTexels = 512;
/// Width of a pixel outside the grid, relative to the one before it: about 6 % of the distance from the grid.
constexpr float kGrowth = 1.06F;
/// Least cosine between a surface and the ray that sees it: the area of a surfel is at most ten times its image.
constexpr float kMinSurfelCosine = 0.1F;

/// Lowest position of a surfel.
constexpr float kMinHeight = 1e-3F;
/// Triangles that are thinner in the image, relative to their length, are left out: their sides are those of rounding.
constexpr float kMinAspect = 1e-5F;

/// Twice the area, positive if c is on the left of a -> b.
float doubled_area(float ax, float ay, float bx, float by, float cx, float cy) {
  return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
}

}  // namespace

void SurfelGroup::set(std::size_t k, const Surfel& surfel) {
  x[k] = surfel.position.x;
  y[k] = surfel.position.y;
  z[k] = surfel.position.z;
  radius2[k] = surfel.radius * surfel.radius;
  area_x[k] = surfel.area.x;
  area_y[k] = surfel.area.y;
  area_z[k] = surfel.area.z;
  red[k] = surfel.radiance.r;
  green[k] = surfel.radiance.g;
  blue[k] = surfel.radiance.b;
  children[k] = surfel.children;
}

void ImageAxis::build(int texels, float texel, float low, float high) {
  centre_.clear();
  width_.clear();
  per_texel_ = texels > kMaxDividedTexels ? 1 : 2;
  const float pixel = texel / static_cast<float>(per_texel_);
  const int inside = texels * per_texel_;
  // Those before the grid, from the outermost one.
  int before = 0;
  float edge = 0, width = pixel;
  while (edge > low) {
    width *= kGrowth;
    edge -= width;
    ++before;
  }
  origin_ = before;
  const auto add = [&](float start, float length) {
    if (start + length < low || start > high) {
      if (centre_.empty()) --origin_;
      return;
    }
    centre_.push_back(start + length / 2);
    width_.push_back(length);
  };
  for (int k = 0; k < before; ++k) {
    add(edge, width);
    edge += width;
    width /= kGrowth;
  }
  for (int k = 0; k < inside; ++k) add(static_cast<float>(k) * pixel, pixel);
  edge = static_cast<float>(inside) * pixel;
  width = pixel;
  while (edge < high) {
    width *= kGrowth;
    add(edge, width);
    edge += width;
  }
}

int ImageAxis::first_from(float x) const {
  return static_cast<int>(std::lower_bound(centre_.begin(), centre_.end(), x) - centre_.begin());
}

ImageAxis::Range ImageAxis::of_texel(int texel) const {
  const int first = origin_ + texel * per_texel_;
  return {first, first + per_texel_ - 1};
}

void MirrorImage::build(const MirrorScene& scene) {
  scene_ = scene;
  const Vec3f eye = scene.eye;
  groups_.clear();
  projected_.clear();
  constexpr float kMax = std::numeric_limits<float>::max();
  Vec3f low{kMax, kMax, 0}, high{-kMax, -kMax, 0};
  for (const MirrorVertex& v : scene.vertices) {
    const Vec3f p = v.position;
    // Where the line from the mirrored eye to the vertex crosses the plane.
    const float s = p.z / (eye.z + p.z);
    projected_.push_back({p.x + (eye.x - p.x) * s, p.y + (eye.y - p.y) * s, eye.z * s});
    low = {std::min(low.x, projected_.back().x), std::min(low.y, projected_.back().y), 0};
    high = {std::max(high.x, projected_.back().x), std::max(high.y, projected_.back().y), 0};
  }
  x_.build(scene.columns, 1, low.x, high.x);
  y_.build(scene.rows, scene.row_height, low.y, high.y);
  pixels_.assign(static_cast<std::size_t>(x_.size()) * static_cast<std::size_t>(y_.size()), {});
  if (pixels_.empty()) return;
  for (std::uint32_t t = 0; t < scene.triangles.size(); ++t) rasterize(t);
  find_inside();
  const auto side = static_cast<unsigned>(std::max(x_.size(), y_.size()));
  Surfel root;
  if (!gather(std::bit_width(side - 1), 0, 0, root)) return;
  groups_.emplace_back().set(0, root);
}

void MirrorImage::rasterize(std::uint32_t triangle) {
  const auto& [ia, ib, ic] = scene_.triangles[triangle];
  const Projected &a = projected_[ia], &b = projected_[ib], &c = projected_[ic];
  const float area = doubled_area(a.x, a.y, b.x, b.y, c.x, c.y);
  const float left = std::min({a.x, b.x, c.x}), right = std::max({a.x, b.x, c.x});
  const float bottom = std::min({a.y, b.y, c.y}), top = std::max({a.y, b.y, c.y});
  const float extent = std::max(right - left, top - bottom);
  if (!(std::abs(area) > kMinAspect * extent * extent) || !std::isfinite(1 / area)) return;
  const int first_column = x_.first_from(left), first_row = y_.first_from(bottom);
  for (int j = first_row; j < y_.size() && y_.centre(j) <= top; ++j)
    for (int i = first_column; i < x_.size() && x_.centre(i) <= right; ++i) {
      const float x = x_.centre(i), y = y_.centre(j);
      const float u = doubled_area(b.x, b.y, c.x, c.y, x, y) / area;
      const float v = doubled_area(c.x, c.y, a.x, a.y, x, y) / area;
      const float w = doubled_area(a.x, a.y, b.x, b.y, x, y) / area;
      if (u < 0 || v < 0 || w < 0) continue;
      const float depth = u * a.depth + v * b.depth + w * c.depth;
      Pixel& nearest =
          pixels_[static_cast<std::size_t>(j) * static_cast<std::size_t>(x_.size()) + static_cast<std::size_t>(i)];
      if (nearest.triangle == 0 || depth < nearest.depth) nearest = {depth, triangle + 1};
    }
}

/// The winding number of the section around the centre of each pixel; 0 in rows where the section is not closed.
void MirrorImage::find_inside() {
  winding_.clear();
  if (scene_.section.empty()) return;
  winding_.assign(pixels_.size(), 0);
  const auto columns = static_cast<std::size_t>(x_.size());
  // First the change at the pixel on the right of each crossing of a row.
  for (const SectionEdge& edge : scene_.section) {
    const bool up = edge.from_y < edge.to_y;
    const float low = up ? edge.from_y : edge.to_y, high = up ? edge.to_y : edge.from_y;
    for (int j = y_.first_from(low); j < y_.size() && y_.centre(j) < high; ++j) {
      const float t = (y_.centre(j) - edge.from_y) / (edge.to_y - edge.from_y);
      const int i = x_.first_from(edge.from_x + (edge.to_x - edge.from_x) * t);
      if (i < x_.size()) winding_[static_cast<std::size_t>(j) * columns + static_cast<std::size_t>(i)] += up ? 1 : -1;
    }
  }
  for (std::size_t row = 0; row < winding_.size(); row += columns) {
    const auto begin = winding_.begin() + static_cast<std::ptrdiff_t>(row);
    const auto end = begin + static_cast<std::ptrdiff_t>(columns);
    std::partial_sum(begin, end, begin);
    if (*(end - 1) != 0) std::fill(begin, end, std::int32_t{0});
  }
}

MirrorImage::Sample MirrorImage::sample(const Pixel& pixel, float x, float y) const {
  const auto& corners = scene_.triangles[pixel.triangle - 1];
  const Projected &a = projected_[corners[0]], &b = projected_[corners[1]], &c = projected_[corners[2]];
  const float share[] = {doubled_area(b.x, b.y, c.x, c.y, x, y), doubled_area(c.x, c.y, a.x, a.y, x, y),
                         doubled_area(a.x, a.y, b.x, b.y, x, y)};
  // Linear in space over the distance from the mirrored eye, which is proportional to 1 / (1 - s).
  Sample out;
  float sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const MirrorVertex& vertex = scene_.vertices[corners[k]];
    const float weight = share[k] * (scene_.eye.z / (scene_.eye.z + vertex.position.z));
    out.position += vertex.position * weight;
    out.radiance += vertex.radiance * weight;
    sum += weight;
  }
  out.position = out.position * (1 / sum);
  out.radiance = out.radiance * (1 / sum);
  return out;
}

Surfel MirrorImage::leaf(int i, int j) const {
  const Pixel& seen = pixel(i, j);
  const float x = x_.centre(i), y = y_.centre(j), dx = x_.width(i), dy = y_.width(j);
  const Sample at = sample(seen, x, y);
  const Vec3f ray = normalized(Vec3f{x - scene_.eye.x, y - scene_.eye.y, scene_.eye.z});
  // From the plane to the surface the image grows by this.
  const float scale = (scene_.eye.z + at.position.z) / scene_.eye.z;
  const auto& [ia, ib, ic] = scene_.triangles[seen.triangle - 1];
  const Vec3f origin = scene_.vertices[ia].position;
  const Vec3f normal = normalized(cross(scene_.vertices[ib].position - origin, scene_.vertices[ic].position - origin));
  const float cosine = dot(normal, ray), size = std::max(std::abs(cosine), kMinSurfelCosine);
  Surfel out;
  out.position = at.position;
  out.radiance = at.radiance;
  out.weight = dx * dy * ray.z * scale * scale;
  out.area = normal * ((cosine > 0 ? -out.weight : out.weight) / size);
  // Half of that diagonal which is longer across the ray.
  const float along = std::abs(std::abs(ray.x) * dx - std::abs(ray.y) * dy);
  out.radius = scale / 2 * std::sqrt(std::max(0.0F, dx * dx + dy * dy - along * along));
  return out;
}

/// Merges the square of 2^level pixels at (i, j) in units of that size; false if nothing is seen in it.
bool MirrorImage::gather(int level, int i, int j, Surfel& out) {
  const int size = 1 << level;
  if (i * size >= x_.size() || j * size >= y_.size()) return false;
  if (level == 0) {
    const std::size_t at =
        static_cast<std::size_t>(j) * static_cast<std::size_t>(x_.size()) + static_cast<std::size_t>(i);
    // From inside, what other points of the plane do not see.
    if (pixels_[at].triangle == 0 || (!winding_.empty() && winding_[at] != 0)) return false;
    out = leaf(i, j);
    // The plane does not reflect what lies on it.
    return out.position.z > kMinHeight;
  }
  std::array<Surfel, 4> parts;
  std::uint32_t count = 0;
  for (int k = 0; k < 4; ++k)
    if (gather(level - 1, 2 * i + k % 2, 2 * j + k / 2, parts[count])) ++count;
  if (count == 0) return false;
  if (count == 1) {
    out = parts[0];
    return true;
  }
  out = {};
  for (std::uint32_t k = 0; k < count; ++k) {
    const Surfel& part = parts[k];
    out.weight += part.weight;
    out.area += part.area;
    out.position += part.position * part.weight;
    out.radiance += part.radiance * part.weight;
  }
  out.position = out.position * (1 / out.weight);
  out.radiance = out.radiance * (1 / out.weight);
  SurfelGroup& group = groups_.emplace_back();
  out.children = static_cast<std::uint32_t>(groups_.size());
  for (std::uint32_t k = 0; k < count; ++k) {
    out.radius = std::max(out.radius, length(parts[k].position - out.position) + parts[k].radius);
    group.set(k, parts[k]);
  }
  return true;
}

MirrorTexel MirrorImage::texel(int column, int row) const {
  MirrorTexel out;
  const ImageAxis::Range columns = x_.of_texel(column), rows = y_.of_texel(row);
  const int pixels = (columns.last - columns.first + 1) * (rows.last - rows.first + 1);
  int covered = 0;
  for (int j = std::max(rows.first, 0); j <= std::min(rows.last, y_.size() - 1); ++j)
    for (int i = std::max(columns.first, 0); i <= std::min(columns.last, x_.size() - 1); ++i) {
      const Pixel& seen = pixel(i, j);
      if (seen.triangle == 0) continue;
      const float x = x_.centre(i), y = y_.centre(j);
      const Sample at = sample(seen, x, y);
      out.radiance += at.radiance;
      out.distance += length(at.position - Vec3f{x, y, 0});
      ++covered;
    }
  if (covered == 0) return {};
  out.covered = static_cast<float>(covered) / static_cast<float>(pixels);
  out.radiance = out.radiance * (1 / static_cast<float>(pixels));
  out.distance /= static_cast<float>(covered);
  return out;
}

}  // namespace lightwell::core
