#include "estimate/specular/plane_warp.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace lightwell::specular {
namespace {

/// Of the grid that is projected exactly: intervals along a side of the plane. Third differences need three.
constexpr int kFewestIntervals = 8;
/// Smallest depth of the plane, relative to its largest, with which positions are weighted by depth.
constexpr double kMinDepth = 0.05;

int max_width(const RigParameters& rig) {
  int width = 1;
  for (const LensParameters& lens : rig.lenses) width = std::max(width, lens.width);
  return width;
}

}  // namespace

PlaneWarp::PlaneWarp(const RigParameters& rig, const PlaneTexels& texels)
    : rig_(rig), texels_(texels), row_(max_width(rig)) {
  for (const LensParameters& lens : rig.lenses) cameras_.emplace_back(lens);
  const auto corners = static_cast<std::size_t>(texels.tiles() + 1);
  corners_.resize(corners * corners);
  homogeneous_.resize(corners_.size());
}

Vec3d PlaneWarp::lens_in_plane(const Pose& probe_plane) const {
  const Pose& probe_lens = rig_.lenses[static_cast<std::size_t>(lens_)].pose_cv;
  return transformed(inverse(probe_plane), probe_lens.translation);
}

double PlaneWarp::pixel_rad(const Pose& probe_plane) const {
  const Vec3d lens = lens_in_plane(probe_plane);
  const Pose lens_plane = compose(inverse(rig_.lenses[static_cast<std::size_t>(lens_)].pose_cv), probe_plane);
  const CameraModel& camera = cameras_[static_cast<std::size_t>(lens_)];
  // Two points of the plane on a line across the line of sight.
  const Vec3d across = normalized(Vec3d{-lens.y, lens.x + 1e-12, 0}) * (0.05 * texels_.size_m);
  const auto a = camera.project(transformed(lens_plane, across)), b = camera.project(transformed(lens_plane, -across));
  if (!a || !b) return std::numeric_limits<double>::infinity();
  return angle_between(lens - across, lens + across) / std::max(1e-6, std::hypot(a->x - b->x, a->y - b->y));
}

bool PlaneWarp::project_corners(const Pose& lens_plane, int stride) {
  const CameraModel& camera = cameras_[static_cast<std::size_t>(lens_)];
  // Points of the plane are linear in column and row.
  const Vec3d origin = transformed(lens_plane, texels_.point(0, 0));
  const Vec3d right = transformed(lens_plane, texels_.point(kTileEdge, 0)) - origin;
  const Vec3d down = transformed(lens_plane, texels_.point(0, kTileEdge)) - origin;
  const int count = texels_.tiles() + 1;
  // Weighted by the depth, a pinhole's positions are linear. Depth is none for a lens that sees around itself.
  const double across = (count - 1) * right.z, along = (count - 1) * down.z;
  const double nearest = origin.z + std::min(across, 0.0) + std::min(along, 0.0);
  const bool by_depth = nearest > kMinDepth * (origin.z + std::max(across, 0.0) + std::max(along, 0.0));
  bool inside = true;
  for (int j = 0; j < count; j += stride)
    for (int i = 0; i < count; i += stride) {
      const Vec3d point = origin + right * double(i) + down * double(j);
      const auto pixel = camera.project(point);
      const double w = by_depth ? point.z : 1;
      inside = inside && pixel.has_value();
      homogeneous_[static_cast<std::size_t>(j * count + i)] =
          pixel ? vec_cast<float>(Vec3d{pixel->x * w, pixel->y * w, w}) : Vec3f{kMissing, kMissing, 1};
    }
  return inside;
}

float PlaneWarp::interpolation_error(int stride) const {
  const int count = texels_.tiles() + 1;
  float third = 0, least_w = std::numeric_limits<float>::max();
  const auto add = [&](int first, int step) {
    const Vec3f* h = &homogeneous_[static_cast<std::size_t>(first)];
    const Vec3f d = h[3 * step] - h[0] + 3.0F * (h[step] - h[2 * step]);
    third = std::max({third, std::abs(d.x), std::abs(d.y)});
    least_w = std::min({least_w, h[0].z, h[3 * step].z});
  };
  for (int j = 0; j < count; j += stride)
    for (int i = 0; i + 3 * stride < count; i += stride) {
      add(j * count + i, stride);
      add(i * count + j, stride * count);
    }
  // Quadratic interpolation over three nodes: 1 / (9 sqrt 3) of the third difference; 1.25 times the error of the rows
  // is carried into the columns.
  return third / least_w * (1 + 1.25F) / 15.6F;
}

void PlaneWarp::interpolate_corners(int stride) {
  const int count = texels_.tiles() + 1;
  // Quadratic Lagrange interpolation over three nodes, along the rows that have nodes, then along columns.
  const auto fill = [&](int first, int step) {
    Vec3f* h = &homogeneous_[static_cast<std::size_t>(first)];
    const Vec3f a = h[0], m = h[stride * step], b = h[2 * stride * step];
    for (int k = 1; k < 2 * stride; ++k) {
      const float t = static_cast<float>(k) / static_cast<float>(stride) - 1;
      h[k * step] = 0.5F * t * (t - 1) * a + (1 - t * t) * m + 0.5F * t * (t + 1) * b;
    }
  };
  for (int j = 0; j < count; j += stride)
    for (int i = 0; i + 2 * stride < count; i += 2 * stride) fill(j * count + i, 1);
  for (int j = 0; j + 2 * stride < count; j += 2 * stride)
    for (int i = 0; i < count; ++i) fill(j * count + i, count);
}

std::span<const PlaneWarp::Corner> PlaneWarp::corners(const Pose& probe_plane) {
  const Pose lens_plane = compose(inverse(rig_.lenses[static_cast<std::size_t>(lens_)].pose_cv), probe_plane);
  int stride = texels_.tiles() / kFewestIntervals;
  for (; stride > 1; stride /= 2) {
    if (texels_.tiles() % (2 * stride) != 0) continue;
    if (!project_corners(lens_plane, stride)) {
      // Beyond the domain nothing can be interpolated: the exact projection says which corners are inside.
      stride = 1;
      break;
    }
    // Third differences vary within an interval: half of the limit is used.
    if (2 * interpolation_error(stride) < static_cast<float>(kMaxCornerError_px)) break;
  }
  if (stride > 1) {
    interpolate_corners(stride);
  } else {
    (void)project_corners(lens_plane, 1);
  }
  for (std::size_t k = 0; k < corners_.size(); ++k) {
    const Vec3f h = homogeneous_[k];
    corners_[k] = {h.x / h.z, h.y / h.z};
  }
  return corners_;
}

bool PlaneWarp::load(estimate::RowReader& reader, int lens, const Pose& probe_plane, double margin_px, double scale) {
  lens_ = lens;
  width_ = height_ = 0;
  estimate::ReadStatistics ignored;
  if (!(lens_in_plane(probe_plane).z > 0)) return false;
  float low_x = std::numeric_limits<float>::max(), low_y = low_x, high_x = -low_x, high_y = -low_x;
  for (const Corner& c : corners(probe_plane)) {
    // std::min and std::max keep their first argument where the second one is NaN.
    low_x = std::min(low_x, c.x), high_x = std::max(high_x, c.x);
    low_y = std::min(low_y, c.y), high_y = std::max(high_y, c.y);
  }
  if (!(low_x <= high_x)) return false;
  const LensParameters& parameters = rig_.lenses[static_cast<std::size_t>(lens)];
  const auto clamped = [margin_px](double at, double margin_sign, int size) {
    return static_cast<int>(std::clamp(std::floor(at + margin_sign * margin_px), 0.0, double(size)));
  };
  left_ = clamped(low_x, -1, parameters.width), top_ = clamped(low_y, -1, parameters.height);
  const int right = clamped(high_x + 2.0, 1, parameters.width), bottom = clamped(high_y + 2.0, 1, parameters.height);
  if (right - left_ < 2 || bottom - top_ < 2) return false;
  width_ = right - left_, height_ = bottom - top_;
  // A row more: a position at the edge may be rounded to the next pixel.
  pixels_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_ + 1) + 1);
  luminance_.resize(pixels_.size());
  const auto factor = static_cast<float>(scale);
  for (int y = 0; y < height_; ++y) {
    reader.read(lens, top_ + y, left_, right, estimate::RowReader::Reading::with_clipped, row_, ignored);
    Pixel* out = &pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_)];
    float* luminance = &luminance_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_)];
    for (int x = 0; x < width_; ++x) {
      const auto k = static_cast<std::size_t>(x);
      const float clipped = row_.certain || row_.clipped[k] == 0 ? 0.0F : 1.0F;
      out[x] = {{row_.r[k] * factor, row_.g[k] * factor, row_.b[k] * factor, clipped}};
      luminance[x] = clipped > 0 ? kMissing : luminance_of(out[x].v[0], out[x].v[1], out[x].v[2]);
    }
  }
  return true;
}

template <int edge, class Visit>
void PlaneWarp::visit_points(const Pose& probe_plane, Visit&& visit) {
  if (width_ == 0) return;
  const Corner* corner = corners(probe_plane).data();
  const int tiles = texels_.tiles(), count = tiles + 1;
  const auto left = static_cast<float>(left_), top_edge = static_cast<float>(top_);
  const auto right = static_cast<float>(left_ + width_ - 1), bottom_edge = static_cast<float>(top_ + height_ - 1);
  // False for NaN.
  const auto inside = [&](const Corner& c) {
    return c.x >= left && c.y >= top_edge && c.x < right && c.y < bottom_edge;
  };
  constexpr int kPoints = edge * edge;
  for (int tile_row = 0; tile_row < tiles; ++tile_row)
    for (int tile_column = 0; tile_column < tiles; ++tile_column) {
      const Corner* top = corner + tile_row * count + tile_column;
      const Corner* bottom = top + count;
      if (!inside(top[0]) || !inside(top[1]) || !inside(bottom[0]) || !inside(bottom[1])) continue;
      // Bilinear: origin + right u + down v + twist u v.
      const float x0 = top[0].x - left, xu = top[1].x - top[0].x, xv = bottom[0].x - top[0].x;
      const float y0 = top[0].y - top_edge, yu = top[1].y - top[0].y, yv = bottom[0].y - top[0].y;
      const float xuv = bottom[1].x - bottom[0].x - xu, yuv = bottom[1].y - bottom[0].y - yu;
      std::array<float, kPoints> fx, fy;
      std::array<int, kPoints> offset;
      for (int k = 0; k < kPoints; ++k) {
        const float u = (static_cast<float>(k % edge) + 0.5F) / edge, v = (static_cast<float>(k / edge) + 0.5F) / edge;
        const float x = x0 + xu * u + (xv + xuv * u) * v, y = y0 + yu * u + (yv + yuv * u) * v;
        const int column = static_cast<int>(x), row = static_cast<int>(y);
        const auto n = static_cast<std::size_t>(k);
        fx[n] = x - static_cast<float>(column), fy[n] = y - static_cast<float>(row);
        offset[n] = row * width_ + column;
      }
      visit(tile_row, tile_column, offset, fx, fy);
    }
}

void PlaneWarp::sample(const Pose& probe_plane, TexelImage& out) {
  out.assign(texels_.count(), TexelRadiance{});
  const std::ptrdiff_t width = width_;
  visit_points<kTileEdge>(
      probe_plane, [&](int tile_row, int tile_column, const auto& offset, const auto& fx, const auto& fy) {
        TexelRadiance* texels = &out[static_cast<std::size_t>((tile_row * texels_.edge + tile_column) * kTileEdge)];
        for (std::size_t k = 0; k < kTileTexels; ++k) {
          const Pixel* p = &pixels_[static_cast<std::size_t>(offset[k])];
          const Pixel* q = p + width;
          const float w11 = fx[k] * fy[k], w10 = fx[k] - w11, w01 = fy[k] - w11, w00 = 1 - fx[k] - w01;
          Pixel sum;
          for (int c = 0; c < 4; ++c) sum.v[c] = w00 * p[0].v[c] + w10 * p[1].v[c] + w01 * q[0].v[c] + w11 * q[1].v[c];
          texels[k / kTileEdge * static_cast<std::size_t>(texels_.edge) + k % kTileEdge] = {sum.v[0], sum.v[1],
                                                                                            sum.v[2], sum.v[3]};
        }
      });
}

void PlaneWarp::sample_luminance(const Pose& probe_plane, int cell, std::vector<float>& out) {
  const int edge = texels_.edge / cell;
  out.assign(static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge), kMissing);
  const std::ptrdiff_t width = width_;
  const auto at = [&](int offset, float fx, float fy) {
    const float* p = &luminance_[static_cast<std::size_t>(offset)];
    const float upper = p[0] + (p[1] - p[0]) * fx, lower = p[width] + (p[width + 1] - p[width]) * fx;
    return upper + (lower - upper) * fy;
  };
  if (cell == kTileEdge) {
    visit_points<2>(probe_plane,
                    [&](int tile_row, int tile_column, const auto& offset, const auto& fx, const auto& fy) {
                      float sum = 0;
                      for (std::size_t k = 0; k < 4; ++k) sum += at(offset[k], fx[k], fy[k]);
                      out[static_cast<std::size_t>(tile_row * edge + tile_column)] = 0.25F * sum;
                    });
    return;
  }
  visit_points<kTileEdge>(probe_plane, [&](int tile_row, int tile_column, const auto& offset, const auto& fx,
                                           const auto& fy) {
    std::array<float, kTileTexels> value;
    for (std::size_t k = 0; k < kTileTexels; ++k) value[k] = at(offset[k], fx[k], fy[k]);
    const int cells = kTileEdge / cell;
    float* cell_at = &out[static_cast<std::size_t>((tile_row * edge + tile_column) * cells)];
    for (int j = 0; j < cells; ++j)
      for (int i = 0; i < cells; ++i) {
        const auto k = static_cast<std::size_t>((j * kTileEdge + i) * cell);
        cell_at[j * edge + i] =
            cell == 1 ? value[k] : 0.25F * (value[k] + value[k + 1] + value[k + kTileEdge] + value[k + kTileEdge + 1]);
      }
  });
}

}  // namespace lightwell::specular
