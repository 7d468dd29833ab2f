#include "estimate/specular/plane_warp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lightwell::specular {
namespace {

int max_width(const RigParameters& rig) {
  int width = 1;
  for (const LensParameters& lens : rig.lenses) width = std::max(width, lens.width);
  return width;
}

}  // namespace

PlaneWarp::PlaneWarp(const RigParameters& rig, const PlaneTexels& texels)
    : rig_(rig), texels_(texels), row_(max_width(rig)) {
  for (const LensParameters& lens : rig.lenses) cameras_.emplace_back(lens);
  const auto nodes = static_cast<std::size_t>(texels.tiles() + 1);
  nodes_.resize(nodes * nodes);
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

std::size_t PlaneWarp::project_nodes(const Pose& probe_plane, int stride) {
  const Pose lens_plane = compose(inverse(rig_.lenses[static_cast<std::size_t>(lens_)].pose_cv), probe_plane);
  const CameraModel& camera = cameras_[static_cast<std::size_t>(lens_)];
  // Points of the plane are linear in column and row.
  const Vec3d origin = transformed(lens_plane, texels_.point(0, 0));
  const Vec3d right = transformed(lens_plane, texels_.point(kTileEdge, 0)) - origin;
  const Vec3d down = transformed(lens_plane, texels_.point(0, kTileEdge)) - origin;
  const int count = texels_.tiles() + 1;
  if ((count - 1) % stride != 0) stride = 1;
  const auto node_at = [&](int i, int j) -> Node& { return nodes_[static_cast<std::size_t>(j * count + i)]; };
  std::size_t projected = 0;
  for (int j = 0; j < count; j += stride)
    for (int i = 0; i < count; i += stride) {
      Node& node = node_at(i, j);
      const auto pixel = camera.project(origin + right * double(i) + down * double(j));
      node.inside = pixel.has_value();
      if (!pixel) continue;
      node.x = static_cast<float>(pixel->x), node.y = static_cast<float>(pixel->y);
      ++projected;
    }
  if (stride == 1) return projected;
  const auto middle = [](const Node& a, const Node& b) {
    return Node{0.5F * (a.x + b.x), 0.5F * (a.y + b.y), a.inside && b.inside};
  };
  for (int j = 0; j < count; j += 2)
    for (int i = 1; i < count; i += 2) node_at(i, j) = middle(node_at(i - 1, j), node_at(i + 1, j));
  for (int j = 1; j < count; j += 2)
    for (int i = 0; i < count; ++i) node_at(i, j) = middle(node_at(i, j - 1), node_at(i, j + 1));
  return projected;
}

bool PlaneWarp::load(estimate::RowReader& reader, int lens, const Pose& probe_plane, double margin_px, double scale) {
  lens_ = lens;
  width_ = height_ = 0;
  estimate::ReadStatistics ignored;
  if (!(lens_in_plane(probe_plane).z > 0) || project_nodes(probe_plane, 1) == 0) return false;
  float low_x = std::numeric_limits<float>::max(), low_y = low_x, high_x = -low_x, high_y = -low_x;
  for (const Node& node : nodes_) {
    if (!node.inside) continue;
    low_x = std::min(low_x, node.x), high_x = std::max(high_x, node.x);
    low_y = std::min(low_y, node.y), high_y = std::max(high_y, node.y);
  }
  const LensParameters& parameters = rig_.lenses[static_cast<std::size_t>(lens)];
  const auto clamped = [margin_px](double at, double margin_sign, int size) {
    return static_cast<int>(std::clamp(std::floor(at + margin_sign * margin_px), 0.0, double(size)));
  };
  left_ = clamped(low_x, -1, parameters.width), top_ = clamped(low_y, -1, parameters.height);
  const int right = clamped(high_x + 2.0, 1, parameters.width), bottom = clamped(high_y + 2.0, 1, parameters.height);
  if (right - left_ < 2 || bottom - top_ < 2) return false;
  width_ = right - left_, height_ = bottom - top_;
  pixels_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  const auto factor = static_cast<float>(scale);
  for (int y = 0; y < height_; ++y) {
    reader.read(lens, top_ + y, left_, right, estimate::RowReader::Reading::with_clipped, row_, ignored);
    Pixel* out = &pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_)];
    for (int x = 0; x < width_; ++x) {
      const auto k = static_cast<std::size_t>(x);
      const float clipped = row_.certain || row_.clipped[k] == 0 ? 0.0F : 1.0F;
      out[x] = {{row_.r[k] * factor, row_.g[k] * factor, row_.b[k] * factor, clipped}};
    }
  }
  return true;
}

template <int edge, class Visit>
void PlaneWarp::visit_points(const Pose& probe_plane, Visit&& visit) {
  if (width_ == 0) return;
  (void)project_nodes(probe_plane, edge < kTileEdge ? 2 : 1);
  const int tiles = texels_.tiles(), nodes = tiles + 1;
  const auto left = static_cast<float>(left_), top_edge = static_cast<float>(top_);
  const auto inside = [&](const Node& node) {
    const float x = node.x - left, y = node.y - top_edge;
    return node.inside && x >= 0 && y >= 0 && x < static_cast<float>(width_ - 1) && y < static_cast<float>(height_ - 1);
  };
  constexpr float kStep = 1.0F / edge;
  for (int tile_row = 0; tile_row < tiles; ++tile_row)
    for (int tile_column = 0; tile_column < tiles; ++tile_column) {
      const Node* top = &nodes_[static_cast<std::size_t>(tile_row * nodes + tile_column)];
      const Node* bottom = top + nodes;
      if (!inside(top[0]) || !inside(top[1]) || !inside(bottom[0]) || !inside(bottom[1])) continue;
      for (int j = 0; j < edge; ++j) {
        const float v = (static_cast<float>(j) + 0.5F) * kStep;
        const float x0 = top[0].x + (bottom[0].x - top[0].x) * v - left;
        const float x1 = top[1].x + (bottom[1].x - top[1].x) * v - left;
        const float y0 = top[0].y + (bottom[0].y - top[0].y) * v - top_edge;
        const float y1 = top[1].y + (bottom[1].y - top[1].y) * v - top_edge;
        for (int i = 0; i < edge; ++i) {
          const float u = (static_cast<float>(i) + 0.5F) * kStep;
          const float x = x0 + (x1 - x0) * u, y = y0 + (y1 - y0) * u;
          const int column = static_cast<int>(x), row = static_cast<int>(y);
          const float fx = x - static_cast<float>(column), fy = y - static_cast<float>(row);
          const Pixel* p = &pixels_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                                    static_cast<std::size_t>(column)];
          const Pixel* q = p + width_;
          const float w00 = (1 - fx) * (1 - fy), w10 = fx * (1 - fy), w01 = (1 - fx) * fy, w11 = fx * fy;
          Pixel sum;
          for (int c = 0; c < 4; ++c) sum.v[c] = w00 * p[0].v[c] + w10 * p[1].v[c] + w01 * q[0].v[c] + w11 * q[1].v[c];
          visit(tile_row, tile_column, j, i, sum);
        }
      }
    }
}

void PlaneWarp::sample(const Pose& probe_plane, TexelImage& out) {
  out.assign(texels_.count(), TexelRadiance{});
  visit_points<kTileEdge>(probe_plane, [&](int tile_row, int tile_column, int j, int i, const Pixel& p) {
    out[static_cast<std::size_t>((tile_row * kTileEdge + j) * texels_.edge + tile_column * kTileEdge + i)] = {
        p.v[0], p.v[1], p.v[2], p.v[3]};
  });
}

void PlaneWarp::sample_tiles(const Pose& probe_plane, std::vector<float>& out) {
  const int tiles = texels_.tiles();
  constexpr float kMissing = std::numeric_limits<float>::quiet_NaN();
  out.assign(static_cast<std::size_t>(tiles) * static_cast<std::size_t>(tiles), kMissing);
  visit_points<2>(probe_plane, [&](int tile_row, int tile_column, int j, int i, const Pixel& p) {
    float& tile = out[static_cast<std::size_t>(tile_row * tiles + tile_column)];
    if (j + i == 0) tile = 0;
    const TexelRadiance texel{p.v[0], p.v[1], p.v[2], p.v[3]};
    tile += texel.measured() ? 0.25F * texel.luminance() : kMissing;
  });
}

}  // namespace lightwell::specular
