#include "bench/straughn2018.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace lightwell::bench {

namespace {

/// Eq. 3.13 with its weights as printed, which sum to 1.03; the division by a point's maximum cancels that.
double luminance_of(double r, double g, double b) { return 0.33 * r + 0.59 * g + 0.11 * b; }

double encoded(double linear, StraughnEncoding encoding) {
  if (encoding == StraughnEncoding::linear) return linear;
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

double brightest(const MarkerPatch& patch) { return std::max({patch.albedo[0], patch.albedo[1], patch.albedo[2]}); }

FacePoint centroid(const FaceOutline& outline) {
  double area = 0;
  FacePoint sum;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const FacePoint &a = outline[k], &b = outline[(k + 1) % outline.size()];
    const double twice = a.x * b.y - b.x * a.y;
    area += twice;
    sum.x += twice * (a.x + b.x);
    sum.y += twice * (a.y + b.y);
  }
  return {sum.x / (3 * area), sum.y / (3 * area)};
}

/// Distance of a point inside its outline to the outline.
double depth(const FaceOutline& outline, FacePoint p) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const FacePoint &a = outline[k], &b = outline[(k + 1) % outline.size()];
    least = std::min(least, ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x)) / std::hypot(b.x - a.x, b.y - a.y));
  }
  return least;
}

std::vector<StraughnPoint> points_of(const MarkerFace& face, double white, StraughnEncoding encoding,
                                     std::size_t per_quadrant) {
  struct Candidate {
    double depth;
    StraughnPoint point;
  };
  std::array<std::vector<Candidate>, 4> quadrants;
  for (const MarkerPatch& patch : face.patches) {
    const FacePoint at = centroid(patch.outline);
    const auto reference = [&](std::size_t c) { return encoded(patch.albedo[c] / white, encoding); };
    quadrants[(at.x < 0 ? 0U : 1U) + (at.y < 0 ? 2U : 0U)].push_back(
        {depth(patch.outline, at), {at, luminance_of(reference(0), reference(1), reference(2))}});
  }
  std::vector<StraughnPoint> points;
  for (auto& quadrant : quadrants) {
    std::stable_sort(quadrant.begin(), quadrant.end(), [](const auto& a, const auto& b) { return a.depth > b.depth; });
    for (std::size_t k = 0; k < std::min(per_quadrant, quadrant.size()); ++k) points.push_back(quadrant[k].point);
  }
  return points;
}

Vec3d normal_of(const Pose& pose) { return rotate(pose.rotation, Vec3d{0, 0, 1}); }

/// The third column of P F_C, with the perspective matrix P that ARToolkit makes from a camera's calibration; near /
/// far is taken as zero.
Vec3d perceived(Vec3d normal, const StraughnCamera& camera) {
  const double skew_x = (2 * camera.cx + 1) / camera.width - 1, skew_y = (2 * camera.cy + 1) / camera.height - 1;
  return normalized(Vec3d{2 * camera.fx / camera.width * normal.x + skew_x * normal.z,
                          2 * camera.fy / camera.height * normal.y + skew_y * normal.z, normal.z});
}

/// The luminance at a point of a face, eq. 3.6 to 3.13; std::nullopt outside the image or behind the camera.
std::optional<double> luminance_at(const StraughnPicture& picture, const StraughnCamera& camera,
                                   const Pose& camera_face, FacePoint p) {
  const Vec3d at = transformed(camera_face, {p.x, p.y, 0});
  if (!(at.z > 0)) return std::nullopt;
  // 3.6 to 3.8: the perspective matrix and the division by z; y points up in the image plane and down in pixels.
  const double plane_x = 2 * (camera.fx * at.x / at.z + camera.cx + 0.5) / camera.width - 1;
  const double plane_y = 1 - 2 * (camera.fy * at.y / at.z + camera.cy + 0.5) / camera.height;
  const double texture_x = (plane_x + 1) / 2, texture_y = (plane_y + 1) / 2;                     // 3.9, 3.10
  const double pixel_x = texture_x * picture.width, pixel_y = (1 - texture_y) * picture.height;  // 3.11, 3.12
  if (!(pixel_x >= 0 && pixel_x < picture.width && pixel_y >= 0 && pixel_y < picture.height)) return std::nullopt;
  const std::uint8_t* pixel = picture.data.data() + static_cast<std::size_t>(pixel_y) * picture.stride +
                              static_cast<std::size_t>(pixel_x) * static_cast<std::size_t>(picture.channels);
  const auto channel = [&](int c) { return pixel[picture.channels == 3 ? c : 0] / 255.0; };
  return luminance_of(channel(0), channel(1), channel(2));
}

double area_px(const StraughnTag& tag) {
  double twice = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const FacePoint &a = tag.corners_px[k], &b = tag.corners_px[(k + 1) % 4];
    twice += a.x * b.y - b.x * a.y;
  }
  return std::abs(twice) / 2;
}

/// The light vector of a shadowed face, unweighted.
Vec3d shadowed_vector(const StraughnMarker& marker, std::span<const StraughnView> seen, const StraughnView& face,
                      double threshold) {
  Vec3d sum;
  for (const StraughnView& other : seen) {
    const auto& adjacent = marker.faces[face.face].adjacent;
    if (other.luminance < threshold || std::find(adjacent.begin(), adjacent.end(), other.face) == adjacent.end())
      continue;
    sum += 2 * dot(face.normal_cv, other.normal_cv) * other.normal_cv - face.normal_cv;
  }
  const Vec3d mean = normalized(sum);
  return mean == Vec3d{} ? -face.normal_cv : mean;
}

}  // namespace

StraughnMarker straughn_marker(const MarkerBody& body, StraughnEncoding encoding, std::size_t points_per_quadrant) {
  StraughnMarker marker;
  marker.tag_size_m = body.tag_size_m;
  double white = 0;
  for (const MarkerFace& face : body.faces)
    for (const MarkerPatch& patch : face.patches) white = std::max(white, brightest(patch));
  double nearest = -1;
  for (const MarkerFace& a : body.faces) {
    marker.faces.push_back({a.tag_id, a.body_face, points_of(a, white, encoding, points_per_quadrant), {}});
    for (const MarkerFace& b : body.faces)
      if (&a != &b) nearest = std::max(nearest, dot(normal_of(a.body_face), normal_of(b.body_face)));
  }
  // For regular bodies the cosine of the next nearest face is smaller by 0.4 or more.
  constexpr double kSame = 0.05;
  for (std::size_t a = 0; a < marker.faces.size(); ++a)
    for (std::size_t b = 0; b < marker.faces.size(); ++b)
      if (a != b && dot(normal_of(marker.faces[a].body_face), normal_of(marker.faces[b].body_face)) > nearest - kSame)
        marker.faces[a].adjacent.push_back(b);
  return marker;
}

std::optional<Pose> straughn_face_pose(const StraughnTag& tag, const StraughnCamera& camera, double tag_size_m) {
  const double half = tag_size_m / 2;
  // The corner order of IPPE_SQUARE for a tag with y down and z away from the viewer. With y up, a tag that faces the
  // camera has a rotation vector of length pi, for which OpenCV's IPPE returns zero.
  const std::vector<cv::Point3d> corners{{-half, half, 0}, {half, half, 0}, {half, -half, 0}, {-half, -half, 0}};
  std::vector<cv::Point2d> pixels;
  for (const FacePoint& p : tag.corners_px) pixels.emplace_back(p.x, p.y);
  const cv::Matx33d matrix(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  cv::Vec3d turn, shift;
  if (!cv::solvePnP(corners, pixels, matrix, cv::noArray(), turn, shift, false, cv::SOLVEPNP_IPPE_SQUARE))
    return std::nullopt;
  const double angle = cv::norm(turn);
  if (!std::isfinite(angle + cv::norm(shift)) || !(shift[2] > 0)) return std::nullopt;
  const Vec3d axis = normalized(Vec3d{turn[0], turn[1], turn[2]});
  constexpr Quat kOver{1, 0, 0, 0};
  return Pose{(Quat::about(axis, angle) * kOver).normalized(), {shift[0], shift[1], shift[2]}};
}

std::vector<StraughnView> straughn_sample(const StraughnPicture& picture, const StraughnCamera& camera,
                                          const StraughnMarker& marker, std::span<const StraughnTag> tags,
                                          const StraughnOptions& options) {
  std::vector<std::optional<Pose>> poses(marker.faces.size());
  std::vector<double> areas(marker.faces.size(), 0.0);
  std::optional<Pose> camera_body;
  double largest = 0;
  for (const StraughnTag& tag : tags) {
    for (std::size_t k = 0; k < marker.faces.size(); ++k) {
      if (marker.faces[k].tag_id != tag.id || area_px(tag) <= areas[k]) continue;
      const std::optional<Pose> pose = straughn_face_pose(tag, camera, marker.tag_size_m);
      if (!pose) continue;
      poses[k] = pose;
      areas[k] = area_px(tag);
      if (areas[k] <= largest) continue;
      largest = areas[k];
      camera_body = compose(*pose, inverse(marker.faces[k].body_face));  // 3.1
    }
  }
  std::vector<StraughnView> seen;
  if (!camera_body) return seen;
  for (std::size_t k = 0; k < marker.faces.size(); ++k) {
    const StraughnFace& face = marker.faces[k];
    const Pose pose = poses[k] ? *poses[k] : compose(*camera_body, face.body_face);  // 3.5
    const bool letter = options.normals == StraughnOptions::Normals::letter;
    const Vec3d normal = letter ? perceived(normal_of(pose), camera) : normalized(normal_of(pose));
    if (!poses[k]) {
      // After the perspective matrix, all rays are parallel to the axis.
      const Vec3d towards_eye = letter ? Vec3d{0, 0, -1} : normalized(-pose.translation);
      if (!(dot(normal, towards_eye) > options.visible_cosine)) continue;
    }
    double sum = 0;
    int count = 0;
    for (const StraughnPoint& point : face.points) {
      const std::optional<double> luminance = luminance_at(picture, camera, pose, point.at);
      if (!luminance || !(point.max_luminance > 0)) continue;
      sum += *luminance / point.max_luminance;
      ++count;
    }
    if (count > 0) seen.push_back({k, poses[k].has_value(), normal, sum / count});
  }
  return seen;
}

StraughnLight straughn_light(const StraughnMarker& marker, std::span<const StraughnView> seen,
                             const StraughnOptions& options) {
  StraughnLight light;
  if (seen.empty()) return light;
  const auto [lowest, highest] = std::minmax_element(
      seen.begin(), seen.end(), [](const StraughnView& a, const StraughnView& b) { return a.luminance < b.luminance; });
  light.intensity = highest->luminance;
  light.ambient = lowest->luminance > options.max_ambient ? options.default_ambient : lowest->luminance;
  Vec3d sum;
  for (const StraughnView& face : seen) {
    if (face.luminance >= options.threshold) {
      sum += face.normal_cv * face.luminance;
      continue;
    }
    const double darkness = 1 - (face.luminance - light.ambient) / (options.threshold - light.ambient);  // 3.14
    sum += shadowed_vector(marker, seen, face, options.threshold) * darkness;
  }
  const Vec3d cv = normalized(sum);
  light.known = cv != Vec3d{};
  light.direction = {cv.x, -cv.y, -cv.z};
  return light;
}

std::optional<StraughnThreshold> straughn_best_threshold(std::span<const StraughnCase> cases, StraughnOptions options) {
  constexpr int kSteps = 256;
  std::vector<double> means;
  for (int step = 0; step <= kSteps; ++step) {
    options.threshold = step / static_cast<double>(kSteps);
    double sum = 0;
    int count = 0;
    for (const StraughnCase& one : cases) {
      const StraughnLight light = straughn_light(*one.marker, one.seen, options);
      if (!light.known) continue;
      sum += angle_between(light.direction, one.truth);
      ++count;
    }
    means.push_back(count > 0 ? sum / count : std::numeric_limits<double>::infinity());
  }
  const auto best = std::min_element(means.begin(), means.end());
  if (!std::isfinite(*best)) return std::nullopt;
  auto end = best;
  while (std::next(end) != means.end() && *std::next(end) <= *best) ++end;
  const auto middle = best + (end - best) / 2;
  return StraughnThreshold{static_cast<double>(middle - means.begin()) / kSteps, *best};
}

}  // namespace lightwell::bench
