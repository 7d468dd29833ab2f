#include "estimate/marker/sampler.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimate/marker/gloss.hpp"
#include "estimate/marker/tag_border.hpp"

namespace lightwell::marker {
namespace {

/// Width of the margin inside a patch's edge that is excluded, because of blur and the error of the pose. All margins
/// are for a blur of up to 1 px and grow in proportion above.
constexpr double kMargin_px = 1.5;
/// A patch that is not uniform is read again with margins wider by this factor, up to a largest one: a slit beside a
/// face that is not folded as the body's file says.
constexpr double kMarginStep = 2, kMaxMargin_px = 6;
/// The same for black cells: of the white around them, a blur of 1 px leaves 0.6 % there.
constexpr double kInkMargin_px = 2.5;
/// Smallest cosine of the angle between a face's normal and the direction to the lens; other faces are not sampled.
constexpr double kMinViewCosine = 0.12;
/// Smallest number of pixels inside the margin of a patch.
constexpr int kMinPixels = 12;
/// Largest relative sigma of luminance about a plane; above it, a shadow's edge or another object is in the patch.
constexpr double kMaxNonuniformity = 0.10;
/// Number of ground samples, before those that are hidden are excluded.
constexpr int kGroundSamples = 400;
/// Number of those that are seen below which the step is made smaller, and the smallest factor of the step.
constexpr double kMinGroundSamples = 250, kMinGroundStepFactor = 0.4;
/// Round patches of a ball: their number over the whole sphere, and their angular radius.
constexpr int kBallPatches = 80;
constexpr double kBallPatchRadius = 0.14;  // rad
constexpr int kBallCorners = 8;
/// Radius of the sampled part of the ground plane, relative to that of the body's hull.
constexpr double kGroundRadiusFactor = 3.4;
/// Points along each side of a ground sample, and how many of all have to be seen: the table beside the body, where
/// shadows begin, is often seen in part.
constexpr int kGroundPointsPerSample = 4, kMinGroundPoints = 8;
/// Patches of a surface, for the numbers of patches: a thousand, more than any face has.
constexpr int kMaxPatches = 1000;
/// Largest share of saturated pixels in a patch.
constexpr double kMaxSaturatedFraction = 0.01;
/// Relative sigma of the irradiance times the cosine of the viewing angle: grazed paper is not Lambertian.
constexpr double kGrazingRelativeSigma = 0.003;

/// Sums for a least-squares plane of luminance over a patch. Coordinates are relative to its first pixel.
struct PlaneSums {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, l = 0, ll = 0, lx = 0, ly = 0;

  void add(double px, double py, double lum) {
    n += 1, x += px, y += py, xx += px * px, xy += px * py, yy += py * py;
    l += lum, ll += lum * lum, lx += lum * px, ly += lum * py;
  }
  /// Variance of luminance about the fitted plane.
  [[nodiscard]] double residual_variance() const {
    const double cxx = xx - x * x / n, cxy = xy - x * y / n, cyy = yy - y * y / n;
    const double clx = lx - l * x / n, cly = ly - l * y / n, cll = ll - l * l / n;
    const double det = cxx * cyy - cxy * cxy;
    double explained = 0;
    if (det > 1e-9 * cxx * cyy) {
      const double a = (cyy * clx - cxy * cly) / det, b = (cxx * cly - cxy * clx) / det;
      explained = a * clx + b * cly;
    }
    return std::max(0.0, cll - explained) / std::max(1.0, n - 3);
  }
};

/// Cells across a tag36h11, its black border included.
constexpr double kCells = 8;

}  // namespace

struct MarkerSampler::PixelSums {
  PlaneSums plane;
  double color[3] = {0, 0, 0}, variance = 0, bias = 0, clipped = 0;
  double first_x = 0, first_y = 0;
};

SphereCoverage sphere_coverage(std::span<const VisibleSurface> surfaces) {
  static const std::vector<Vec3d> directions = fibonacci_directions(2048);
  int covered = 0, saturated = 0;
  for (const Vec3d& d : directions) {
    bool above_any = false, above_readable = false;
    for (const VisibleSurface& s : surfaces) {
      if (!(dot(s.normal, d) > 0)) continue;
      above_any = true;
      above_readable = above_readable || !s.saturated;
    }
    covered += above_any ? 1 : 0;
    saturated += above_any && !above_readable ? 1 : 0;
  }
  return {static_cast<double>(covered) / static_cast<double>(directions.size()),
          covered > 0 ? static_cast<double>(saturated) / covered : 0};
}

void MarkerSampler::record_surface(Vec3d normal, std::size_t samples, int clipped, const Shading& out) {
  const bool readable = out.samples.size() > samples;
  if (readable || counts_.clipped > clipped) surfaces_.push_back({normal, !readable});
}

bool MarkerSampler::project_outline(const std::vector<Vec3d>& points) {
  outline_.clear();
  for (const Vec3d& point : points) {
    const std::optional<PixelPosition> p = posed_body_->pixel_of(point);
    if (!p) return false;
    outline_.add(p->x, p->y);
  }
  return outline_.close();
}

void MarkerSampler::add_pixels(const std::vector<Vec3d>& corners, double margin, PixelSums& sums) {
  if (!project_outline(corners)) return;
  const auto [lowest, highest] = outline_.y_range();
  const int top = std::max(0, static_cast<int>(std::ceil(lowest))),
            bottom = std::min(height_ - 1, static_cast<int>(std::floor(highest)));
  for (int y = top; y <= bottom; ++y) {
    const auto [from, to] = outline_.inside_at(y, margin);
    if (!(from <= to)) continue;
    const int first = std::max(0, static_cast<int>(std::ceil(from))),
              end = std::min(width_, static_cast<int>(std::floor(to)) + 1);
    if (first >= end) continue;
    reader_->read(lens_, y, first, end, estimate::RowReader::Reading::with_errors, row_, reading_);
    if (sums.plane.n == 0) sums.first_x = first, sums.first_y = y;
    for (int x = first; x < end; ++x) {
      const auto i = static_cast<std::size_t>(x - first);
      const double r = row_.r[i], g = row_.g[i], b = row_.b[i];
      sums.color[0] += r, sums.color[1] += g, sums.color[2] += b;
      if (!row_.certain) sums.variance += row_.variance[i], sums.bias += row_.bias[i], sums.clipped += row_.clipped[i];
      sums.plane.add(x - sums.first_x, y - sums.first_y, luminance({r, g, b}));
    }
  }
}

void MarkerSampler::sample_patch(const Patch& patch, Shading& out) {
  ++counts_.patches;
  Vec3d middle;
  for (const Vec3d& corner : patch.corners) middle += corner;
  middle = middle * (1.0 / static_cast<double>(patch.corners.size()));
  PixelSums sums;
  double mean = 0, noise = 0, nonuniformity = 0;
  for (double margin = kMargin_px;; margin *= kMarginStep) {
    sums = {};
    add_pixels(patch.corners, margin_factor_ * margin, sums);
    const PlaneSums& plane = sums.plane;
    if (plane.n < kMinPixels) {
      ++(margin > kMargin_px ? counts_.nonuniform : counts_.too_small);
      return;
    }
    mean = plane.l / plane.n;
    noise = sums.variance / plane.n;
    nonuniformity = std::sqrt(std::max(0.0, plane.residual_variance() - 1.5 * noise));
    if (margin == kMargin_px) {
      counts_.brightest = std::max(counts_.brightest, mean);
      counts_.near_black_bias += sums.bias / plane.n;
    }
    if (sums.clipped > kMaxSaturatedFraction * plane.n) {
      ++counts_.clipped;
      return;
    }
    if (nonuniformity <= kMaxNonuniformity * std::abs(mean) + 1e-12) break;
    if (margin * kMarginStep > kMaxMargin_px) {
      ++counts_.nonuniform;
      return;
    }
  }
  const PlaneSums& plane = sums.plane;
  SurfaceSample sample;
  sample.position = middle;
  sample.normal = patch.normal;
  sample.surface = patch.surface;
  sample.occluder_radius = patch.occluder_radius;
  sample.squared_angle = std::pow(posed_body_->axis_angle(middle), 2);
  sample.patch = patch.number;
  const double grazing_relative_sigma =
      kGrazingRelativeSigma / std::max(kMinViewCosine, dot(normalized(posed_body_->lens() - middle), patch.normal));
  const double spread = std::sqrt(noise / plane.n) + 0.3 * nonuniformity + sums.bias / plane.n;
  for (std::size_t c = 0; c < 3; ++c) {
    const double factor = std::numbers::pi / patch.albedo[c] * scale_;
    sample.irradiance[c] = std::max(0.0, sums.color[c] / plane.n * factor);
    sample.sigma[c] = spread * factor + grazing_relative_sigma * sample.irradiance[c];
  }
  out.samples.push_back(sample);
}

void MarkerSampler::sample_ink(const MarkerBody& body, const MarkerFace& face, int surface, Shading& out) {
  if (body.tag_family != "tag36h11" || face.patches.empty()) return;
  const double cell = body.tag_size_m / kCells, outer = kCells / 2 * cell, inner = outer - cell;
  PixelSums sums;
  for (int side = 0; side < 4; ++side) {
    const double sign = side < 2 ? 1 : -1;
    patch_.corners.clear();
    for (const auto& [across, along] : {std::pair{inner, -inner}, {inner, inner}, {outer, inner}, {outer, -inner}})
      patch_.corners.push_back(posed_body_->point_of(
          face, side % 2 == 0 ? FacePoint{sign * across, along} : FacePoint{along, sign * across}));
    add_pixels(patch_.corners, margin_factor_ * kInkMargin_px, sums);
  }
  const double n = sums.plane.n;
  if (n < kMinPixels || sums.clipped > 0) return;
  InkSample sample{.surface = surface};
  for (const MarkerPatch& patch : face.patches)
    sample.paper_albedo += luminance(patch.albedo) / static_cast<double>(face.patches.size());
  sample.radiance = sums.plane.l / n * scale_;
  sample.sigma = (std::sqrt(sums.variance) / n + sums.bias / n) * scale_;
  out.ink.push_back(sample);
}

void MarkerSampler::sample_ball(const MarkerBody& body, const PosedBody& posed_body, Shading& out) {
  static const std::vector<Vec3d> normals = fibonacci_directions(kBallPatches);
  const double radius = body.ball->radius_m;
  patch_.albedo = body.ball->albedo;
  patch_.surface = static_cast<int>(body.faces.size());
  patch_.occluder_radius = 0;
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const Vec3d normal = normals[k];
    patch_.number = patch_.surface * kMaxPatches + static_cast<int>(k);
    if (dot(normalized(posed_body.lens() - normal * radius), normal) < std::max(kMinViewCosine, 0.35)) continue;
    const auto [u, v] = tangent_basis(normal);
    patch_.corners.clear();
    for (int corner = 0; corner < kBallCorners; ++corner) {
      const double a = 2 * std::numbers::pi * corner / kBallCorners;
      patch_.corners.push_back(
          (normal * std::cos(kBallPatchRadius) + (u * std::cos(a) + v * std::sin(a)) * std::sin(kBallPatchRadius)) *
          radius);
    }
    patch_.normal = normal;
    const std::size_t samples_before = out.samples.size();
    const int clipped = counts_.clipped;
    sample_patch(patch_, out);
    record_surface(normal, samples_before, clipped, out);
  }
}

void MarkerSampler::sample_ground(const MarkerBody& body, Shading& out) {
  const GroundPlane& ground = *out.ground;
  double radius = 0;
  for (const Vec3d& p : out.hull) radius = std::max(radius, length(p));
  // The body hides the ground plane.
  if (!project_outline(out.hull)) return;
  const double reach = kGroundRadiusFactor * radius;
  double step = reach * std::sqrt(std::numbers::pi / kGroundSamples);
  // Where the body or the edge of the image hides most of the plane, the rest is sampled more finely.
  const int seen = count_ground_samples(reach, step, ground);
  if (seen > 0 && seen < kMinGroundSamples) {
    const double factor = std::max(kMinGroundStepFactor, std::sqrt(seen / kMinGroundSamples));
    step *= factor;
    out.ground->density = 1 / (factor * factor);
  }
  sample_ground_grid(body, reach, radius, step, out);
}

std::optional<PixelPosition> MarkerSampler::ground_pixel(Vec3d point) const {
  const std::optional<PixelPosition> p = posed_body_->pixel_of(point);
  if (!p || !(p->x > -0.5 && p->y > -0.5 && p->x < width_ - 0.5 && p->y < height_ - 0.5) ||
      !(outline_.signed_distance(p->x, p->y) > 2 * margin_factor_ * kMargin_px))
    return std::nullopt;
  return p;
}

int MarkerSampler::count_ground_samples(double reach, double step, const GroundPlane& ground) const {
  const auto [u, v] = tangent_basis(ground.normal);
  const Vec3d foot = ground.normal * dot(ground.point, ground.normal);
  const int across = static_cast<int>(reach / step) + 1;
  const double corner = (0.5 - 0.5 / kGroundPointsPerSample) * step;
  int whole = 0;
  for (int iy = -across; iy <= across; ++iy)
    for (int ix = -across; ix <= across; ++ix) {
      const double x = ix * step, y = iy * step;
      if (std::hypot(x, y) > reach) continue;
      const auto seen = [&](double dx, double dy) {
        return ground_pixel(foot + u * (x + dx) + v * (y + dy)).has_value();
      };
      whole += seen(-corner, -corner) && seen(corner, -corner) && seen(-corner, corner) && seen(corner, corner) ? 1 : 0;
    }
  return whole;
}

void MarkerSampler::sample_ground_grid(const MarkerBody& body, double reach, double radius, double step, Shading& out) {
  GroundPlane& ground = *out.ground;
  ground.step_m = step;
  ground.samples.clear();
  covers_.clear();
  const auto [u, v] = tangent_basis(ground.normal);
  const double height = -dot(ground.point, ground.normal);
  const Vec3d foot = ground.normal * -height;
  const int across = static_cast<int>(reach / step) + 1;
  for (int iy = -across; iy <= across; ++iy) {
    for (int ix = -across; ix <= across; ++ix) {
      const double x = ix * step, y = iy * step, off = std::hypot(x, y);
      if (off > reach) continue;
      GroundSample sample;
      sample.position = foot + u * x + v * y;
      const GroundCover cover = ground_cover(body, *posed_body_, sample.position, step / 2);
      if (cover == GroundCover::mixed) continue;
      double sum = 0, squares = 0, variance = 0, n = 0, bias = 0;
      Rgb color{};
      Vec3d seen;
      bool good = true;
      constexpr int kPoints = kGroundPointsPerSample * kGroundPointsPerSample;
      // Enough points may still be seen while n + kPoints - k is at least kMinGroundPoints.
      for (int k = 0; k < kPoints && good && n + kPoints - k >= kMinGroundPoints; ++k) {
        const double dx = ((k % kGroundPointsPerSample + 0.5) / kGroundPointsPerSample - 0.5) * step,
                     dy = ((k / kGroundPointsPerSample + 0.5) / kGroundPointsPerSample - 0.5) * step;
        const Vec3d point = sample.position + u * dx + v * dy;
        const std::optional<PixelPosition> p = ground_pixel(point);
        if (!p) continue;
        const int px = std::clamp(static_cast<int>(std::lround(p->x)), 0, width_ - 1);
        const int py = std::clamp(static_cast<int>(std::lround(p->y)), 0, height_ - 1);
        reader_->read(lens_, py, px, px + 1, estimate::RowReader::Reading::with_errors, row_, reading_);
        const double l = (static_cast<double>(row_.r[0]) + row_.g[0] + row_.b[0]) / 3;
        if (!row_.certain) {
          good = row_.clipped[0] == 0;
          variance += row_.variance[0];
          bias += row_.bias[0];
        }
        sum += l, squares += l * l, n += 1;
        seen += point;
        color[0] += row_.r[0], color[1] += row_.g[0], color[2] += row_.b[0];
      }
      if (!good || n < kMinGroundPoints) continue;
      sample.position = seen * (1 / n);
      const double mean = sum / n;
      sample.radiance = mean * scale_;
      for (std::size_t c = 0; c < 3; ++c) sample.color[c] = color[c] / n * scale_;
      sample.sigma = (std::sqrt(std::max(variance, std::max(0.0, squares - n * mean * mean))) / n + bias / n) * scale_;
      // View factor of a sphere as large as the body from a small horizontal surface: r² cos / d² (Howell, "A catalog
      // of radiation heat transfer configuration factors", B-37).
      const double squared = off * off + height * height;
      sample.occluded = std::min(0.9, 0.8 * radius * radius * height / (squared * std::sqrt(squared)));
      ground.samples.push_back(sample);
      covers_.push_back(cover);
    }
  }
  remove_clutter(ground, covers_);
  equalize_sheet(ground, covers_);
}

void MarkerSampler::choose_faces(const MarkerBody& body) {
  faces_.clear();
  for (std::size_t f = 0; f < body.faces.size(); ++f) {
    const MarkerFace& face = body.faces[f];
    const double view_cosine =
        dot(normalized(posed_body_->lens() - posed_body_->point_of(face, {0, 0})), posed_body_->normal_of(face));
    if (view_cosine >= kMinViewCosine) faces_.push_back({f, view_cosine});
  }
  const auto most = options_.max_faces > 0 ? static_cast<std::size_t>(options_.max_faces) : faces_.size();
  std::ranges::stable_sort(faces_, std::ranges::greater(), &VisibleFace::view_cosine);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < faces_.size() && kept < most; ++k) {
    const MarkerFace& face = body.faces[faces_[k].number];
    if (detect_tag_border(*reader_, row_, lens_, width_, height_, body, face, *posed_body_) == TagBorder::absent) {
      counts_.patches += static_cast<int>(face.patches.size());
      counts_.occluded += static_cast<int>(face.patches.size());
      continue;
    }
    faces_[kept++] = faces_[k];
  }
  faces_.resize(kept);
  std::ranges::sort(faces_, {}, &VisibleFace::number);
}

SampleCounts MarkerSampler::sample(estimate::RowReader& reader, int lens, int width, int height, const MarkerBody& body,
                                   const PosedBody& posed_body, double scale, double blur_px, int channels,
                                   Shading& out) {
  reader_ = &reader;
  posed_body_ = &posed_body;
  lens_ = lens, width_ = width, height_ = height, scale_ = scale;
  margin_factor_ = std::max(1.0, blur_px);
  counts_ = {};
  surfaces_.clear();
  reading_ = {};
  out.samples.clear();
  out.ink.clear();
  out.channels = channels;
  out.hull = posed_body.hull();
  choose_faces(body);
  for (const VisibleFace& visible : faces_) {
    const MarkerFace& face = body.faces[visible.number];
    const Vec3d normal = posed_body.normal_of(face);
    const std::size_t samples_before = out.samples.size();
    const int clipped = counts_.clipped;
    for (std::size_t k = 0; k < face.patches.size(); ++k) {
      const MarkerPatch& patch = face.patches[k];
      patch_.number = static_cast<int>(visible.number) * kMaxPatches + static_cast<int>(k);
      patch_.corners.clear();
      for (const FacePoint& p : patch.outline) patch_.corners.push_back(posed_body.point_of(face, p));
      patch_.normal = normal;
      patch_.albedo = patch.albedo;
      patch_.surface = static_cast<int>(visible.number);
      patch_.occluder_radius = body.ball ? body.ball->radius_m : 0;
      sample_patch(patch_, out);
    }
    record_surface(normal, samples_before, clipped, out);
    if (out.samples.size() > samples_before) sample_ink(body, face, static_cast<int>(visible.number), out);
    counts_.faces += out.samples.size() > samples_before ? 1 : 0;
  }
  subtract_gloss(out);
  if (body.ball) sample_ball(body, posed_body, out);
  out.ground = posed_body.ground_plane(options_.up);
  if (out.ground) {
    sample_ground(body, out);
    if (out.ground->samples.empty()) out.ground.reset();
  }
  counts_.invalid_pixels = reading_.invalid_pixels;
  if (counts_.patches > 0) counts_.near_black_bias /= counts_.patches;
  counts_.brightest *= scale, counts_.near_black_bias *= scale;
  return counts_;
}

}  // namespace lightwell::marker
