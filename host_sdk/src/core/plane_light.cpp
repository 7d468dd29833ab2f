#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <lightwell/hemisphere_grid.hpp>
#include <lightwell/plane_light.hpp>

namespace lightwell {
namespace {

/// A tile is divided if its range of radiance over the solid angle that it has at most is more than this share of the
/// mean radiance of the texture times pi.
constexpr double kTileTolerance = 0.01;
/// Receivers are at least this high, in sides of the square: below, the closed form loses its digits.
constexpr double kMinReceiverHeight = 1e-6;
/// Directions at which S is read, and cells into which it is summed.
constexpr int kReadLevels = 60, kBeamLevels = 16;
/// Parts of the square along a side, in which the lighting is read.
constexpr int kLightingParts = 4;

/// The part of a convex polygon with n·r >= 0; `count` vertices, at most one more after it.
template <std::size_t N>
std::size_t clip_at_horizon(std::array<Vec3d, N>& polygon, std::size_t count, Vec3d normal) {
  std::array<Vec3d, N> out;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3d a = polygon[k], b = polygon[(k + 1) % count];
    const double da = dot(a, normal), db = dot(b, normal);
    if (da >= 0) out[kept++] = a;
    if ((da >= 0) != (db >= 0)) out[kept++] = a + (b - a) * (da / (da - db));
  }
  polygon = out;
  return kept;
}

/// Irradiance by a polygon of radiance 1 with these corners, seen from the origin, counterclockwise from above.
double polygon_irradiance(const std::array<Vec3d, 4>& corners, Vec3d normal) {
  std::array<Vec3d, 6> polygon{};
  std::ranges::copy(corners, polygon.begin());
  const std::size_t count = clip_at_horizon(polygon, 4, normal);
  double sum = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3d a = polygon[k], b = polygon[(k + 1) % count];
    const Vec3d across = cross(a, b);
    const double sine = length(across);
    if (sine > 0) sum += std::atan2(sine, dot(a, b)) / sine * dot(across, normal);
  }
  // Seen from above, the corners are counterclockwise; from the receiver above them, the sum is negative.
  return std::max(0.0, -sum / 2);
}

Irradiance from_radiance(Radiance value, double weight) {
  const auto w = static_cast<float>(weight);
  return {value.r * w, value.g * w, value.b * w};
}

Irradiance clamped_at_zero(Irradiance e) {
  for (int c = 0; c < 3; ++c) e[c] = e[c] > 0 ? e[c] : 0;
  return e;
}

bool is_answer(Validity v) { return v == Validity::valid || v == Validity::stale; }

}  // namespace

/// In the texture's frame, in sides of the square: its corners are at +-0.5.
struct PlaneLight::Receiver {
  Vec3d point;
  Vec3d normal;

  [[nodiscard]] double square_irradiance(double left, double bottom, double right, double top) const {
    return polygon_irradiance({Vec3d{left, bottom, 0} - point, Vec3d{right, bottom, 0} - point,
                               Vec3d{right, top, 0} - point, Vec3d{left, top, 0} - point},
                              normal);
  }
};

void PlaneLight::update(const PlaneAppearance& plane) {
  validity_ = plane.validity();
  const bool same = plane.info().capture == info_.capture && plane.revision() == revision_ &&
                    plane.missing_tiles() == missing_ && plane.texture_edge() == edge_;
  if (same) return;
  info_ = plane.info();
  revision_ = plane.revision();
  missing_ = plane.missing_tiles();
  edge_ = plane.texture_edge();
  build_tiles(plane);
  build_beams(plane);
}

void PlaneLight::build_tiles(const PlaneAppearance& plane) {
  tiles_.clear();
  levels_.clear();
  flags_ = {};
  if (edge_ == 0) return;
  const double texel = info_.size_m / edge_;
  Radiance sum;
  std::size_t seen = 0;
  for (int row = 0; row < edge_; ++row)
    for (int column = 0; column < edge_; ++column) {
      const PlanePoint at{(column + 0.5) * texel - info_.size_m / 2, info_.size_m / 2 - (row + 0.5) * texel};
      const PlaneAnswer answer = plane.diffuse(info_.texture_to_plane.plane_point(at));
      flags_ |= answer.flags;
      // Marked by a negative range until the mean is known.
      const bool known = is_answer(answer.validity) && !answer.flags.has(PlaneFlag::unseen_texel);
      if (!known) flags_.set(PlaneFlag::unseen_texel);
      tiles_.push_back({answer.value, known ? 0.0F : -1.0F});
      if (!known) continue;
      sum += answer.value;
      ++seen;
    }
  const Radiance mean = seen > 0 ? sum * (1 / static_cast<float>(seen)) : Radiance{};
  for (Tile& tile : tiles_)
    if (tile.range < 0) tile = {mean, 0};
  levels_.push_back({edge_, 0});
  while (levels_.back().edge > 1) {
    const Level below = levels_.back();
    const Level level{(below.edge + 1) / 2, tiles_.size()};
    const int size = 1 << levels_.size();
    for (int j = 0; j < level.edge; ++j)
      for (int i = 0; i < level.edge; ++i) {
        Radiance low, high, total;
        float area = 0;
        for (int k = 0; k < 4; ++k) {
          const int column = 2 * i + k % 2, row = 2 * j + k / 2;
          if (column >= below.edge || row >= below.edge) continue;
          const Tile& part = tiles_[below.first + static_cast<std::size_t>(row * below.edge + column)];
          const auto width = static_cast<float>(std::min(size / 2, edge_ - column * size / 2));
          const auto height = static_cast<float>(std::min(size / 2, edge_ - row * size / 2));
          for (int c = 0; c < 3; ++c) {
            low[c] = area > 0 ? std::min(low[c], part.mean[c] - part.range) : part.mean[c] - part.range;
            high[c] = area > 0 ? std::max(high[c], part.mean[c] + part.range) : part.mean[c] + part.range;
          }
          total += part.mean * (width * height);
          area += width * height;
        }
        const float range = std::max({high.r - low.r, high.g - low.g, high.b - low.b});
        tiles_.push_back({total * (1 / area), range});
      }
    levels_.push_back(level);
  }
}

void PlaneLight::build_beams(const PlaneAppearance& plane) {
  const HemisphereGrid read(kReadLevels), cells(kBeamLevels);
  beams_.assign(cells.size(), {});
  std::array<float, 1 + 2 * kBeamLevels*(kBeamLevels + 1)> solid{};
  for (std::size_t node = 0; node < read.size(); ++node) {
    const Vec3d direction = read.direction(node);
    const PlaneAnswer answer = plane.specular(direction);
    const std::size_t cell = cells.nearest(vec_cast<float>(direction));
    const auto weight = static_cast<float>(read.solid_angle(node));
    solid[cell] += weight;
    if (!is_answer(answer.validity)) continue;
    beams_[cell].flux += answer.value * weight;
    beams_[cell].direction += vec_cast<float>(direction) * (answer.value.luminance() * weight);
  }
  for (std::size_t cell = 0; cell < beams_.size(); ++cell) {
    Beam& beam = beams_[cell];
    beam.direction = normalized(beam.direction);
    beam.radius = std::sqrt(solid[cell] / std::numbers::pi_v<float>);
  }
  std::erase_if(beams_, [](const Beam& beam) { return !(beam.direction.z > 0); });
}

Validity PlaneLight::check(Vec3d point, Vec3d normal) const {
  if (!is_finite(point) || !(point.z >= 0) || normalized(normal) == Vec3d{}) return Validity::invalid_query;
  return edge_ == 0 ? Validity::none : validity_;
}

PlaneLight::Receiver PlaneLight::place(Vec3d point, Vec3d normal) const {
  const PlaneSimilarity& similarity = info_.texture_to_plane;
  const PlanePoint at = similarity.texture_point({point.x, point.y});
  const double side = info_.size_m;
  const Quat back = Quat::about({0, 0, 1}, -similarity.rotation_rad);
  return {{at.x / side, at.y / side, std::max(point.z / (similarity.scale * side), kMinReceiverHeight)},
          rotate(back, normalized(normal))};
}

Irradiance PlaneLight::diffuse(const Receiver& receiver) const {
  Irradiance out;
  const Tile& whole = tiles_.back();
  const double mean = std::max({whole.mean.r, whole.mean.g, whole.mean.b});
  const double limit = kTileTolerance * std::numbers::pi * mean;
  const double texel = 1.0 / edge_;
  struct Place {
    int level, i, j;
  };
  // Of each of 9 levels three wait.
  std::array<Place, 32> stack{};
  std::size_t waiting = 0;
  stack[waiting++] = {static_cast<int>(levels_.size()) - 1, 0, 0};
  while (waiting > 0) {
    const auto [level, i, j] = stack[--waiting];
    const Level& tiles = levels_[static_cast<std::size_t>(level)];
    const Tile& tile = tiles_[tiles.first + static_cast<std::size_t>(j * tiles.edge + i)];
    const int size = 1 << level;
    const double left = i * size * texel - 0.5, right = std::min((i + 1) * size, edge_) * texel - 0.5;
    const double top = 0.5 - j * size * texel, bottom = 0.5 - std::min((j + 1) * size, edge_) * texel;
    if (level > 0 && tile.range > 0) {
      // The solid angle is at most area * height / distance³, and 2 pi.
      const double x = std::clamp(receiver.point.x, left, right) - receiver.point.x;
      const double y = std::clamp(receiver.point.y, bottom, top) - receiver.point.y, z = receiver.point.z;
      const double square = x * x + y * y + z * z;
      const double solid =
          std::min(2 * std::numbers::pi, (right - left) * (top - bottom) * z / (square * std::sqrt(square)));
      if (double{tile.range} * solid > limit) {
        const int below = levels_[static_cast<std::size_t>(level) - 1].edge;
        for (int k = 0; k < 4; ++k)
          if (2 * i + k % 2 < below && 2 * j + k / 2 < below)
            stack[waiting++] = {level - 1, 2 * i + k % 2, 2 * j + k / 2};
        continue;
      }
    }
    out += from_radiance(tile.mean, receiver.square_irradiance(left, bottom, right, top));
  }
  return out;
}

Irradiance PlaneLight::specular(const Receiver& receiver) const {
  Irradiance out;
  // Beams are in the plane's frame, the receiver in the texture's.
  const double c = std::cos(info_.texture_to_plane.rotation_rad), s = std::sin(info_.texture_to_plane.rotation_rad);
  for (const Beam& beam : beams_) {
    const Vec3d d = vec_cast<double>(beam.direction);
    const Vec3d to_viewer{c * d.x + s * d.y, c * d.y - s * d.x, d.z};
    const double cosine = -dot(receiver.normal, to_viewer);
    if (!(cosine > 0)) continue;
    // Where the beam leaves the plane; near the edge of the square a part of it does.
    const double t = receiver.point.z / d.z;
    const double x = receiver.point.x - t * to_viewer.x, y = receiver.point.y - t * to_viewer.y;
    const double radius = t * double{beam.radius} / d.z;
    const double inside = 0.5 - std::max(std::abs(x), std::abs(y));
    const double share = std::clamp(0.5 + inside / (2 * radius), 0.0, 1.0);
    out += from_radiance(beam.flux, share * cosine);
  }
  return out;
}

/// What the lighting has in the directions of the square.
Irradiance PlaneLight::covered(const Receiver& receiver, const Lighting& lighting) const {
  Irradiance out;
  const Quat to_plane = Quat::about({0, 0, 1}, info_.texture_to_plane.rotation_rad);
  constexpr double kPart = 1.0 / kLightingParts;
  for (int j = 0; j < kLightingParts; ++j)
    for (int i = 0; i < kLightingParts; ++i) {
      const double left = i * kPart - 0.5, bottom = j * kPart - 0.5;
      const double e = receiver.square_irradiance(left, bottom, left + kPart, bottom + kPart);
      if (e == 0) continue;
      const Vec3d middle{left + kPart / 2, bottom + kPart / 2, 0};
      const Vec3d direction = rotate(to_plane, middle - receiver.point);
      out += from_radiance(lighting.radiance(vec_cast<float>(direction), 0).value, e);
    }
  for (const Light& light : lighting.lights()) {
    const Vec3d direction = rotate(to_plane.inverse(), vec_cast<double>(light.direction));
    if (!(direction.z < 0)) continue;
    const double t = -receiver.point.z / direction.z;
    const Vec3d at = receiver.point + direction * t;
    if (std::max(std::abs(at.x), std::abs(at.y)) > 0.5) continue;
    const double cosine = std::max(0.0, dot(receiver.normal, direction));
    out += light.irradiance * static_cast<float>(cosine);
  }
  return out;
}

PlaneLightAnswer PlaneLight::irradiance(Vec3d point, Vec3d normal, PlaneLayers layers) const {
  const Validity validity = check(point, normal);
  if (!is_answer(validity)) return {{}, validity, {}, PlaneLightSource::none};
  const Receiver receiver = place(point, normal);
  Irradiance sum;
  if (layers != PlaneLayers::specular) sum += diffuse(receiver);
  if (layers != PlaneLayers::diffuse) sum += specular(receiver);
  return {clamped_at_zero(sum), validity, flags_, PlaneLightSource::texture};
}

PlaneLightAnswer PlaneLight::irradiance(Vec3d point, Vec3d normal, const Lighting& lighting) const {
  const Validity validity = check(point, normal);
  const Answer<Irradiance> whole = lighting.irradiance(vec_cast<float>(normalized(normal)));
  if (validity == Validity::invalid_query || !is_answer(whole.validity))
    return {{}, validity == Validity::invalid_query ? validity : whole.validity, {}, PlaneLightSource::none};
  if (!is_answer(validity)) return {clamped_at_zero(whole.value), whole.validity, {}, PlaneLightSource::descriptor};
  const Receiver receiver = place(point, normal);
  const Irradiance around = clamped_at_zero(whole.value - covered(receiver, lighting));
  const bool stale = validity == Validity::stale || whole.validity == Validity::stale;
  return {clamped_at_zero(around + diffuse(receiver) + specular(receiver)), stale ? Validity::stale : Validity::valid,
          flags_, PlaneLightSource::texture};
}

}  // namespace lightwell
