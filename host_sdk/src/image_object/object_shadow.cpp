#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include <lightwell/object_shadow.hpp>

#include "image_object/object_light.hpp"
#include "image_object/view_codec.hpp"

namespace lightwell {
namespace {

/// Lights nearer to the zenith have no azimuth: the silhouette is seen from its side, whatever the light.
constexpr double kMinHorizontal = 1e-6;
/// Smallest cosine at the plane of a direction that lights it.
constexpr double kMinCosine = 1e-4;

Status refuse(const std::string& member, const std::string& rule) {
  return invalid_argument("ObjectShadowPlane::" + member + " must be " + rule);
}

/// Directions of a light that reach a plane.
struct LightSamples {
  static constexpr std::size_t kMax = ObjectShadowCaster::kSamples;
  std::array<Vec3d, kMax> towards{};
  std::array<float, kMax> weight{};  ///< Share of the light's irradiance at normal incidence.
  std::size_t count = 0;
  float sum = 0;
};

LightSamples sample_light(const ObjectLight& light, Vec3d axis, Vec3d normal) {
  const auto [u, v] = tangent_basis(axis);
  const double radius = std::sin(static_cast<double>(light.angular_radius_rad));
  const int points = radius > 0 ? ObjectShadowCaster::kSamples : 1;
  LightSamples out;
  for (int k = 0; k < points; ++k) {
    // Vogel's spiral: points of equal area of the disc.
    const double r = points > 1 ? radius * std::sqrt((k + 0.5) / points) : 0;
    const double angle = std::numbers::pi * (3 - std::sqrt(5.0)) * k;
    const Vec3d towards = axis * std::sqrt(1 - r * r) + u * (r * std::cos(angle)) + v * (r * std::sin(angle));
    const double cosine = dot(towards, normal);
    if (!(cosine > kMinCosine)) continue;
    out.towards[out.count] = towards;
    out.weight[out.count++] = static_cast<float>(cosine / points);
    out.sum += static_cast<float>(cosine / points);
  }
  return out;
}

/// The silhouette that stands for a light, on its board through the axis of the turntable.
struct Board {
  const std::uint8_t* coverage = nullptr;
  int columns = 0, rows = 0;
  double scale = 0;         ///< Pixels per metre.
  double scale_across = 0;  ///< The same to the right; negative for a mirrored silhouette.
  Vec3d across, facing;     ///< Unit, horizontal: to the right as the light sees it; towards the light.
};

/// Where rays of a light's samples pass a board: pixel = point's own + slope * distance before the board.
struct BoardRays {
  std::array<float, LightSamples::kMax> across{}, down{}, weight{};
  std::size_t count = 0;
  float reach_across = 0, reach_down = 0;  ///< Largest slopes.
};

BoardRays rays_of(const LightSamples& samples, const Board& board) {
  BoardRays out;
  for (std::size_t k = 0; k < samples.count; ++k) {
    const double slope = dot(samples.towards[k], board.facing);
    if (!(slope > kMinHorizontal)) continue;  // It never passes the board.
    out.across[out.count] = static_cast<float>(board.scale_across * dot(samples.towards[k], board.across) / slope);
    out.down[out.count] = static_cast<float>(-board.scale * samples.towards[k].y / slope);
    out.weight[out.count++] = samples.weight[k];
  }
  for (std::size_t k = 0; k < out.count; ++k) {
    out.reach_across = std::max(out.reach_across, std::abs(out.across[k]));
    out.reach_down = std::max(out.reach_down, std::abs(out.down[k]));
  }
  return out;
}

/// Weight of the samples that see the light from a point.
float visible_weight(const BoardRays& rays, const Board& board, float all, Vec3d at) {
  const auto before = static_cast<float>(-dot(at, board.facing));
  if (!(before > 0)) return all;
  const auto x = static_cast<float>(board.scale_across * dot(at, board.across) + 0.5 * board.columns);
  const auto y = static_cast<float>(0.5 * board.rows - board.scale * at.y);
  const auto width = static_cast<float>(board.columns), height = static_cast<float>(board.rows);
  const float reach_x = rays.reach_across * before, reach_y = rays.reach_down * before;
  if (x + reach_x < 0 || x - reach_x >= width || y + reach_y < 0 || y - reach_y >= height) return all;
  float hidden = 0;
  for (std::size_t k = 0; k < rays.count; ++k) {
    const float column = x + rays.across[k] * before, row = y + rays.down[k] * before;
    if (column >= 0 && row >= 0 && column < width && row < height)
      hidden +=
          rays.weight[k] *
          static_cast<float>(board.coverage[static_cast<std::size_t>(row) * static_cast<std::size_t>(board.columns) +
                                            static_cast<std::size_t>(column)]);
  }
  return all - hidden / 255;
}

}  // namespace

Status ObjectShadowPlane::validate() const {
  const Quat& q = T_object_plane.rotation;
  const double norm2 = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  if (!is_finite(T_object_plane.translation) || !(norm2 > 0) || !std::isfinite(norm2))
    return refuse("T_object_plane", "finite and have a rotation");
  if (!(width_m > 0) || !std::isfinite(width_m)) return refuse("width_m", "above 0 and finite");
  if (!(height_m > 0) || !std::isfinite(height_m)) return refuse("height_m", "above 0 and finite");
  if (columns < 1 || columns > kMaxSide) return refuse("columns", "1 to 4096");
  if (rows < 1 || rows > kMaxSide) return refuse("rows", "1 to 4096");
  return {};
}

Result<ObjectShadowCaster> ObjectShadowCaster::make(const ImageObject& object) {
  ObjectShadowCaster out;
  out.columns_ = object.rig().columns;
  out.rows_ = object.rig().rows;
  out.half_width_m_ = static_cast<double>(object.rig().half_width_m);
  for (std::size_t i = 0; i < object.rig().turns_rad.size(); ++i) {
    auto coverage = object.coverage(i);
    if (!coverage.ok()) return coverage.status();
    // p_rig = R_y(turn) p_object, and the camera is at +Z of the rig.
    out.silhouettes_.push_back({-static_cast<double>(object.rig().turns_rad[i]), std::move(*coverage)});
  }
  return out;
}

Result<ObjectShadowCaster::Summary> ObjectShadowCaster::cast(std::span<const ObjectLight> lights,
                                                             const ObjectShadowPlane& plane,
                                                             std::span<LightRatio> ratios) const {
  if (const Status valid = plane.validate(); !valid.ok()) return valid;
  if (ratios.size() != static_cast<std::size_t>(plane.columns) * static_cast<std::size_t>(plane.rows))
    return invalid_argument("there are " + std::to_string(ratios.size()) + " ratios for " +
                            std::to_string(plane.columns) + " x " + std::to_string(plane.rows) + " texels");
  for (std::size_t i = 0; i < lights.size(); ++i)
    if (const Status valid = image_object::check_light(lights[i], i); !valid.ok()) return valid;

  const Quat turn = plane.T_object_plane.rotation.normalized();
  const Vec3d normal = rotate(turn, Vec3d{0, 0, 1}), right = rotate(turn, Vec3d{1, 0, 0}),
              up = rotate(turn, Vec3d{0, 1, 0});
  const Vec3d corner = plane.T_object_plane.translation + right * (plane.width_m * (0.5 / plane.columns - 0.5)) +
                       up * (plane.height_m * (0.5 - 0.5 / plane.rows));
  const Vec3d next_column = right * (plane.width_m / plane.columns), next_row = up * (-plane.height_m / plane.rows);
  Summary summary;
  std::array<double, 3> total{};
  std::ranges::fill(ratios, LightRatio{});  // Sums of irradiance until the end.
  for (const ObjectLight& light : lights) {
    const Irradiance& e = light.irradiance;
    const Vec3d axis = normalized(vec_cast<double>(light.direction));
    const LightSamples samples = sample_light(light, axis, normal);
    if (samples.count == 0 || !(e.r > 0 || e.g > 0 || e.b > 0)) continue;
    ++summary.lights;

    const bool has_azimuth = std::hypot(axis.x, axis.z) > kMinHorizontal;
    const double azimuth = has_azimuth ? std::atan2(axis.x, axis.z) : silhouettes_[0].azimuth_rad;
    Board board;
    board.columns = columns_;
    board.rows = rows_;
    board.scale = columns_ / (2 * half_width_m_);
    board.facing = {std::sin(azimuth), 0, std::cos(azimuth)};
    board.across = {std::cos(azimuth), 0, -std::sin(azimuth)};
    double nearest = 2 * std::numbers::pi;
    for (const Silhouette& s : silhouettes_)
      for (const bool mirrored : {false, true}) {
        const double from = s.azimuth_rad + (mirrored ? std::numbers::pi : 0);
        const double apart = std::abs(std::remainder(from - azimuth, 2 * std::numbers::pi));
        if (apart >= nearest) continue;
        nearest = apart;
        board.coverage = s.coverage.data();
        board.scale_across = mirrored ? -board.scale : board.scale;
      }
    summary.outside_rad = std::max(summary.outside_rad, static_cast<float>(nearest));

    const BoardRays rays = rays_of(samples, board);
    for (std::size_t c = 0; c < 3; ++c)
      total[c] += static_cast<double>(e[static_cast<int>(c)]) * static_cast<double>(samples.sum);
    std::size_t texel = 0;
    for (int row = 0; row < plane.rows; ++row)
      for (int column = 0; column < plane.columns; ++column)
        ratios[texel++] +=
            LightRatio{e.r, e.g, e.b} *
            visible_weight(rays, board, samples.sum, corner + next_column * double(column) + next_row * double(row));
  }
  for (LightRatio& ratio : ratios)
    for (int c = 0; c < 3; ++c) {
      const double all = total[static_cast<std::size_t>(c)];
      ratio[c] = all > 0 ? static_cast<float>(std::clamp(static_cast<double>(ratio[c]) / all, 0.0, 1.0)) : 1;
    }
  return summary;
}

}  // namespace lightwell
