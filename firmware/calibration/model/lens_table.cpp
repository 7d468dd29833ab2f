#include "calibration/model/lens_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <variant>

#include <lightwell/equirect.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/response.hpp"

namespace lightwell {

namespace {

/// Signed solid angle of a spherical triangle of unit vectors, Van Oosterom & Strackee 1983, eq. 8. The triple product
/// is computed from edge vectors to avoid cancellation for neighbouring corners.
double triangle_solid_angle(Vec3d a, Vec3d b, Vec3d c) {
  const double triple = dot(a, cross(b - a, c - a));
  return 2 * std::atan2(triple, 1 + dot(a, b) + dot(b, c) + dot(c, a));
}

/// A lens with precomputed values for queries per pixel.
struct Lens {
  LensParameters parameters;
  CameraModel model;
  Quat to_probe;
  Vec3d axis;  ///< Probe frame.
  double feather_rad;
  double cos_max_angle;

  Lens(const LensParameters& of, double feather)
      : parameters(of),
        model(of),
        to_probe(of.pose_cv.rotation.normalized()),
        axis(rotate(to_probe, Vec3d{0, 0, 1})),
        feather_rad(feather),
        cos_max_angle(std::cos(model.max_angle_rad())) {}

  /// Index of the pixel that sees a direction in the probe frame.
  [[nodiscard]] std::optional<std::int32_t> pixel_at(Vec3d direction) const {
    // Cheap rejection, which applies to most directions of the other lens.
    if (dot(direction, axis) < cos_max_angle - 1e-9) return std::nullopt;
    const auto at = model.project(rotate(to_probe.inverse(), direction));
    if (!at) return std::nullopt;
    const double column = std::floor(at->x + 0.5), row = std::floor(at->y + 0.5);
    if (!(column >= 0 && column < parameters.width && row >= 0 && row < parameters.height)) return std::nullopt;
    return static_cast<std::int32_t>(row) * parameters.width + static_cast<std::int32_t>(column);
  }

  /// Weight of a direction: 1 inside, falling to 0 over the last feather_rad of the domain, and 0 beyond.
  [[nodiscard]] double weight(double cos_angle) const {
    if (cos_angle <= cos_max_angle) return 0;
    const double left = model.max_angle_rad() - std::acos(std::min(cos_angle, 1.0));
    return feather_rad > 0 ? std::clamp(left / feather_rad, 0.0, 1.0) : 1.0;
  }
};

/// The directions that one pixel sees, in the lens frame: centre, solid angle, corners (on the rim the centre).
struct Patch {
  Vec3d direction;
  double solid_angle = 0;
  std::array<Vec3d, 4> corners{};
};

/// A corner of the pixel grid.
struct Corner {
  PixelPosition at;
  std::optional<Vec3d> direction;
};

/// The boundary of the field of view between a seen and an unseen pixel position, by bisection.
Vec3d field_boundary(const CameraModel& model, PixelPosition seen, PixelPosition unseen) {
  Vec3d last{};
  // 2^-30 pixels: far below the float precision of the solid angle.
  for (int i = 0; i < 30; ++i) {
    const PixelPosition middle{(seen.x + unseen.x) / 2, (seen.y + unseen.y) / 2};
    if (const auto d = model.unproject(middle)) {
      seen = middle;
      last = *d;
    } else {
      unseen = middle;
    }
  }
  return last == Vec3d{} ? model.unproject(seen).value_or(last) : last;
}

/// A pixel on the rim: the visible part of it, with the boundary arc replaced by its chord.
Patch rim_patch(const CameraModel& model, const std::array<Corner, 4>& corners) {
  std::vector<Vec3d> polygon;
  for (std::size_t i = 0; i < 4; ++i) {
    const Corner &from = corners[i], &to = corners[(i + 1) % 4];
    if (from.direction) polygon.push_back(*from.direction);
    if (from.direction && !to.direction) polygon.push_back(field_boundary(model, from.at, to.at));
    if (!from.direction && to.direction) polygon.push_back(field_boundary(model, to.at, from.at));
  }
  Patch patch;
  Vec3d moment{};
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const Vec3d a = polygon[0], b = polygon[i - 1], c = polygon[i];
    const double omega = std::abs(triangle_solid_angle(a, b, c));
    patch.solid_angle += omega;
    moment += (a + b + c) * omega;
  }
  patch.direction = normalized(moment);
  patch.corners.fill(patch.direction);
  return patch;
}

Patch patch_of(const CameraModel& model, const std::array<Corner, 4>& corners, PixelPosition centre) {
  const auto seen =
      std::count_if(corners.begin(), corners.end(), [](const Corner& c) { return c.direction.has_value(); });
  if (seen == 0) return {};
  const auto middle = model.unproject(centre);
  if (seen < 4 || !middle) return rim_patch(model, corners);
  const Vec3d a = *corners[0].direction, b = *corners[1].direction;
  const Vec3d c = *corners[2].direction, d = *corners[3].direction;
  const double omega = std::abs(triangle_solid_angle(a, b, c)) + std::abs(triangle_solid_angle(a, c, d));
  return {*middle, omega, {a, b, c, d}};
}

/// Mean over a pixel of a lens's normalised weight in the overlap. The weight changes its slope within a pixel or two:
/// if it were evaluated only at the centre, the weights of a direction would not sum to one.
double mean_overlap_weight(const Lens& lens, const Lens& other, Vec3d other_axis, const Patch& patch) {
  constexpr int kPerAxis = 4;
  const auto& [a, b, c, d] = patch.corners;
  double sum = 0;
  for (int j = 0; j < kPerAxis; ++j) {
    const double y = (j + 0.5) / kPerAxis;
    const Vec3d left = a * (1 - y) + d * y, right = b * (1 - y) + c * y;
    for (int i = 0; i < kPerAxis; ++i) {
      const double x = (i + 0.5) / kPerAxis;
      // Bilinear interpolation of the corners: the length is nearly one, by a term of second order in the pixel size.
      const Vec3d at = left * (1 - x) + right * x;
      const double other_weight = other.weight(dot(at, other_axis));
      const double own_weight = other_weight > 0 ? lens.weight(at.z) : 1;
      sum += own_weight + other_weight > 0 ? own_weight / (own_weight + other_weight) : 0.5;
    }
  }
  return sum / (kPerAxis * kPerAxis);
}

class TableBuilder {
 public:
  TableBuilder(const Lens& lens, const Lens* other, LensTable& table) : lens_(lens), other_(other), table_(table) {
    table_.width = lens.parameters.width;
    table_.height = lens.parameters.height;
    table_.equirectangular = std::holds_alternative<EquirectangularParameters>(lens.parameters.model);
    const std::size_t pixels = table_.index(0, table_.height);
    table_.rows.resize(static_cast<std::size_t>(table_.height));
    table_.direction.resize(pixels);
    table_.solid_angle.resize(pixels);
    table_.inverse_vignetting.resize(pixels);
    table_.overlap_pixel.assign(pixels, -1);
    if (other != nullptr) other_axis_ = rotate(lens.to_probe.inverse(), other->axis);
  }

  /// Fills the table and returns the sum of its solid angles.
  double build() {
    table_.equirectangular ? equirectangular_rows() : corner_grid();
    return covered_sr_;
  }

 private:
  void equirectangular_rows() {
    for (int j = 0; j < table_.height; ++j) {
      const double omega = equirect_solid_angle(j, table_.width, table_.height);
      for (int i = 0; i < table_.width; ++i) {
        const auto d = lens_.model.unproject({static_cast<double>(i), static_cast<double>(j)});
        if (d) set(i, j, {*d, omega, {*d, *d, *d, *d}});
      }
    }
  }

  /// Processes rows with two rows of corners, because each corner is shared by four pixels.
  void corner_grid() {
    const auto fill = [&](std::vector<Corner>& row, int j) {
      for (std::size_t i = 0; i < row.size(); ++i) {
        row[i].at = {static_cast<double>(i) - 0.5, j - 0.5};
        row[i].direction = lens_.model.unproject(row[i].at);
      }
    };
    std::vector<Corner> above(static_cast<std::size_t>(table_.width) + 1), below(above.size());
    fill(below, 0);
    for (int j = 0; j < table_.height; ++j) {
      above.swap(below);
      fill(below, j + 1);
      for (int i = 0; i < table_.width; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const Patch patch = patch_of(lens_.model, {above[k], above[k + 1], below[k + 1], below[k]},
                                     {static_cast<double>(i), static_cast<double>(j)});
        if (patch.solid_angle > 0) set(i, j, patch);
      }
    }
  }

  void set(int column, int row, const Patch& patch) {
    const std::size_t index = table_.index(column, row);
    const Vec3d d = rotate(lens_.to_probe, patch.direction);
    double share = 1;
    if (other_ != nullptr) {
      const auto overlap = other_->pixel_at(d);
      if (overlap) table_.overlap_pixel[index] = *overlap;
      // Beyond the edge of the other lens's field a part of the pixel may still be visible to it.
      const bool beyond = other_->weight(dot(patch.direction, other_axis_)) == 0;
      if (overlap || beyond) share = mean_overlap_weight(lens_, *other_, other_axis_, patch);
    }
    const double angle = std::atan2(std::hypot(patch.direction.x, patch.direction.y), patch.direction.z);
    table_.direction[index] = vec_cast<float>(d);
    table_.solid_angle[index] = static_cast<float>(patch.solid_angle * share);
    table_.inverse_vignetting[index] = static_cast<float>(1 / vignetting(lens_.parameters.photometry, angle));
    covered_sr_ += patch.solid_angle * share;
    RowSpan& span = table_.rows[static_cast<std::size_t>(row)];
    if (span.end == 0) span.first = column;
    span.end = column + 1;
  }

  const Lens& lens_;
  const Lens* other_;
  Vec3d other_axis_;  ///< In this lens's frame.
  LensTable& table_;
  double covered_sr_ = 0;
};

/// Removes references to pixels without an entry: a pixel may contain a visible direction, but no visible corner.
void drop_empty_overlaps(LensTable& table, const LensTable& other) {
  for (std::int32_t& overlap : table.overlap_pixel)
    if (overlap >= 0 && other.direction[static_cast<std::size_t>(overlap)] == Vec3f{}) overlap = -1;
}

}  // namespace

Result<RigTable> make_rig_table(const RigParameters& rig, double feather_rad) {
  if (Status valid = rig.validate(); !valid.ok()) return valid;
  if (!(feather_rad >= 0) || !std::isfinite(feather_rad)) return invalid_argument("feather_rad must be zero or more");

  std::vector<Lens> lenses;
  for (const LensParameters& parameters : rig.lenses) {
    const auto pixels = static_cast<std::int64_t>(parameters.width) * parameters.height;
    if (pixels > std::numeric_limits<std::int32_t>::max())
      return invalid_argument("a picture of more than 2^31 pixels");
    lenses.emplace_back(parameters, feather_rad);
  }

  RigTable table;
  for (std::size_t i = 0; i < lenses.size(); ++i)
    table.covered_sr +=
        TableBuilder(lenses[i], lenses.size() == 2 ? &lenses[1 - i] : nullptr, table.lenses.emplace_back()).build();
  if (table.lenses.size() == 2) {
    drop_empty_overlaps(table.lenses[0], table.lenses[1]);
    drop_empty_overlaps(table.lenses[1], table.lenses[0]);
  }
  return table;
}

int max_image_width(const RigTable& table) {
  int w = 0;
  for (const LensTable& lens : table.lenses) w = std::max(w, lens.width);
  return w;
}

double pixel_side(const RigTable& table) {
  double pixels = 0;
  for (const LensTable& lens : table.lenses)
    for (const float sr : lens.solid_angle) pixels += sr > 0 ? 1 : 0;
  return std::sqrt(table.covered_sr / std::max(1.0, pixels));
}

}  // namespace lightwell
