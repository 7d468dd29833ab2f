#include "bench/arief2012.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace lightwell::bench {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
/// An upright camera that looks down: elevation above the ground and roll, each with a standard deviation.
constexpr double kElevation_rad = 40 * kDegree, kElevationSigma_rad = 20 * kDegree, kRollSigma_rad = 10 * kDegree;
/// Pixels beside the body's outline that are not used: its blurred edge, and errors of the pose.
constexpr int kMargin_px = 3;
/// A region within this distance beyond the margin touches the body.
constexpr int kTouch_px = 4;
/// The smallest shadow, relative to the body's area in the picture.
constexpr double kMinArea = 0.01;
constexpr std::size_t kMinEdgePoints = 10, kMaxEdgePoints = 120;
constexpr int kMaxLitPoints = 1'000;
/// Longest shadow, in heights of the body: a light 10 degrees above the ground.
constexpr double kMaxShift = 5.7;
/// Limit of the distance of a point to the shadow's edge, in heights of the body.
constexpr float kMaxDistance = 0.1F;

double area_of(const FaceOutline& outline) {
  double twice = 0;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const FacePoint &a = outline[k], &b = outline[(k + 1) % outline.size()];
    twice += a.x * b.y - b.x * a.y;
  }
  return twice / 2;
}

/// Twice the negative logarithm of the likelihood that `up` is up. `to_lens` is unit.
double cost_of(Vec3d up, Vec3d to_lens) {
  const double roll = std::atan2(up.x, -up.y), elevation = std::asin(std::clamp(dot(up, to_lens), -1.0, 1.0));
  return std::pow(roll / kRollSigma_rad, 2) + std::pow((elevation - kElevation_rad) / kElevationSigma_rad, 2);
}

/// Inward normals (lens axes) of the faces on which the body may stand: those with a tag, and one without.
std::vector<Vec3d> ups_of(const MarkerBody& body, const Pose& lens_body) {
  std::vector<Vec3d> ups;
  Vec3d sum;
  double largest = 0;
  for (const MarkerFace& face : body.faces) {
    const Vec3d normal = rotate(lens_body.rotation, rotate(face.body_face.rotation, Vec3d{0, 0, 1}));
    ups.push_back(-normal);
    sum += normal * area_of(face.outline);
    largest = std::max(largest, area_of(face.outline));
  }
  // The vector areas of a closed surface add up to zero, so the sum is opposite to the vector area of a missing face.
  if (length(sum) > largest / 2) ups.push_back(normalized(sum));
  return ups;
}

cv::Mat disc(int radius) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(2 * radius + 1, 2 * radius + 1));
}

cv::Mat as_mat(const std::vector<std::uint8_t>& bytes, int width, int height) {
  return {height, width, CV_8UC1, const_cast<std::uint8_t*>(bytes.data())};
}

std::vector<std::uint8_t> bytes_of(const cv::Mat& mat) {
  const cv::Mat packed = mat.isContinuous() ? mat : mat.clone();
  return {packed.data, packed.data + packed.total()};
}

}  // namespace

bool AriefView::set_plane(const MarkerBody& body, const Pose& lens_body, const std::optional<Vec3d>& up_cv) {
  const Vec3d centre = lens_body.translation, to_lens = normalized(-centre);
  double least = std::numeric_limits<double>::infinity();
  for (const Vec3d& up : ups_of(body, lens_body)) {
    const double cost = up_cv ? -dot(up, *up_cv) : cost_of(up, to_lens);
    if (cost < least) least = cost, up_ = up;
  }
  std::vector<Vec3d> points;
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (const MarkerFace& face : body.faces)
    for (const FacePoint& p : face.outline) {
      const Vec3d point = transformed(compose(lens_body, face.body_face), {p.x, p.y, 0});
      lowest = std::min(lowest, dot(point - centre, up_));
      highest = std::max(highest, dot(point - centre, up_));
      // Neighbouring faces share their corners.
      const auto same = [&](Vec3d other) { return length(point - other) < 1e-4; };
      if (std::none_of(points.begin(), points.end(), same)) points.push_back(point);
    }
  height_m_ = highest - lowest;
  if (!(height_m_ > 0)) return false;
  foot_ = centre + up_ * lowest;
  const auto [right, forward] = tangent_basis(up_);
  right_ = right;
  forward_ = forward;
  for (const Vec3d& p : points) {
    const Vec3d at = (p - foot_) * (1 / height_m_);
    vertices_.push_back({dot(at, right_), dot(at, forward_), dot(at, up_)});
  }
  return dot(foot_, up_) < 0;  // The lens is above the plane.
}

bool AriefView::set_region(const GreyPicture& picture, const CameraModel& lens, double reach) {
  // The bounding box of the circle of the ground and of the body; the whole picture if part of it is out of view.
  constexpr int kSteps = 64;
  std::vector<cv::Point2f> circle, outline;
  for (int k = 0; k < kSteps; ++k) {
    const double angle = 2 * std::numbers::pi * k / kSteps;
    const Vec3d p = foot_ + (right_ * std::cos(angle) + forward_ * std::sin(angle)) * (reach * height_m_);
    if (const auto at = lens.project(p); at && p.z > 0) circle.emplace_back(at->x, at->y);
  }
  for (const Vertex& v : vertices_) {
    const auto at = lens.project(foot_ + (right_ * v.x + forward_ * v.y + up_ * v.z) * height_m_);
    if (!at) return false;
    outline.emplace_back(at->x, at->y);
  }
  cv::Rect region(0, 0, picture.width, picture.height);
  if (circle.size() == kSteps) {
    circle.insert(circle.end(), outline.begin(), outline.end());
    region &= cv::boundingRect(circle);
  }
  if (region.empty()) return false;
  left_ = region.x, top_ = region.y, width_ = region.width, height_ = region.height;

  std::vector<cv::Point2f> hull;
  cv::convexHull(outline, hull);
  std::vector<cv::Point> corners;
  constexpr int kShift = 4;
  for (const cv::Point2f& p : hull)
    corners.emplace_back(cvRound((p.x - static_cast<float>(left_)) * (1 << kShift)),
                         cvRound((p.y - static_cast<float>(top_)) * (1 << kShift)));
  cv::Mat body = cv::Mat::zeros(height_, width_, CV_8UC1), hidden, touching;
  cv::fillConvexPoly(body, corners, cv::Scalar(255), cv::LINE_8, kShift);
  body_px_ = cv::contourArea(hull);
  cv::dilate(body, hidden, disc(kMargin_px));
  cv::dilate(hidden, touching, disc(kTouch_px));
  near_ = bytes_of(touching);

  cv::Mat ground = cv::Mat::zeros(height_, width_, CV_8UC1), inner;
  plane_.assign(ground.total(), Point{});
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      if (hidden.at<std::uint8_t>(y, x) != 0) continue;
      const auto ray = lens.unproject({static_cast<double>(left_ + x), static_cast<double>(top_ + y)});
      if (!ray || !(dot(*ray, up_) < 0)) continue;
      const Vec3d at = (*ray * (dot(foot_, up_) / dot(*ray, up_)) - foot_) * (1 / height_m_);
      const double u = dot(at, right_), v = dot(at, forward_);
      if (std::hypot(u, v) > reach) continue;
      ground.at<std::uint8_t>(y, x) = 255;
      plane_[static_cast<std::size_t>(y * width_ + x)] = {static_cast<float>(u), static_cast<float>(v)};
    }
  cv::erode(ground, inner, disc(2), cv::Point(-1, -1), 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  ground_ = bytes_of(ground);
  inner_ = bytes_of(inner);

  const cv::Mat whole(picture.height, picture.width, CV_8UC1, const_cast<std::uint8_t*>(picture.data.data()),
                      picture.stride);
  cv::Mat smooth;
  cv::GaussianBlur(whole(region), smooth, cv::Size(5, 5), 1);
  grey_ = bytes_of(smooth);
  std::vector<std::uint8_t> values;
  for (std::size_t k = 0; k < grey_.size(); ++k)
    if (ground_[k] != 0) values.push_back(grey_[k]);
  if (values.empty()) return false;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  level_ = *middle;
  return true;
}

std::optional<AriefView> AriefView::make(const GreyPicture& picture, const CameraModel& lens, const MarkerBody& body,
                                         const Pose& lens_body, const AriefOptions& options) {
  AriefView view;
  if (body.ball || !picture.validate().ok() || !view.set_plane(body, lens_body, options.up_cv) ||
      !view.set_region(picture, lens, options.reach))
    return std::nullopt;
  return view;
}

/// `shift`: of a shadow from the foot of its point, per height of the point.
Vec3d AriefView::direction_of(Point shift) const {
  return normalized(up_ - right_ * double{shift.x} - forward_ * double{shift.y});
}

/// Mean distance of the edge's points to the edge of the body's shadow, each at most kMaxDistance, plus that of the lit
/// points inside that shadow.
double AriefView::mismatch(const Observed& seen, Point shift) const {
  std::vector<cv::Point2f> cast, hull;
  for (const Vertex& v : vertices_)
    cast.emplace_back(static_cast<float>(v.x + v.z * shift.x), static_cast<float>(v.y + v.z * shift.y));
  cv::convexHull(cast, hull);  // Counter-clockwise.
  const std::size_t count = hull.size();
  std::vector<cv::Point2f> sides;
  for (std::size_t k = 0; k < count; ++k) sides.push_back(hull[(k + 1) % count] - hull[k]);
  double sum = 0;
  for (const Point& p : seen.edge) {
    float least = kMaxDistance * kMaxDistance;
    for (std::size_t k = 0; k < count; ++k) {
      const cv::Point2f from(p.x - hull[k].x, p.y - hull[k].y);
      const float along = std::clamp(from.dot(sides[k]) / std::max(sides[k].dot(sides[k]), 1e-12F), 0.0F, 1.0F);
      const cv::Point2f off = from - sides[k] * along;
      least = std::min(least, off.dot(off));
    }
    sum += std::sqrt(least);
  }
  for (const Point& p : seen.lit) {
    double depth = kMaxDistance;
    for (std::size_t k = 0; k < count && depth > 0; ++k)
      depth = std::min(depth, sides[k].cross(cv::Point2f(p.x - hull[k].x, p.y - hull[k].y)) / cv::norm(sides[k]));
    sum += std::max(depth, 0.0);
  }
  return sum / static_cast<double>(seen.edge.size());
}

/// The shift with the smallest mismatch: the best of several starts around `first`, then a compass search.
AriefView::Point AriefView::fitted(const Observed& seen, Point first) const {
  Point best = first;
  double least = mismatch(seen, best);
  const auto attempt = [&](Point p) {
    if (std::hypot(p.x, p.y) > kMaxShift) return false;
    const double d = mismatch(seen, p);
    if (d >= least) return false;
    least = d;
    best = p;
    return true;
  };
  for (const double turn_deg : {-60, -40, -20, 0, 20, 40, 60})
    for (const double scale : {0.5, 0.7, 1.0, 1.4, 2.0}) {
      const double c = scale * std::cos(turn_deg * kDegree), s = scale * std::sin(turn_deg * kDegree);
      attempt({static_cast<float>(c * first.x - s * first.y), static_cast<float>(s * first.x + c * first.y)});
    }
  // From a tenth of the body's height to 0.1 degrees of the light's direction.
  for (float step = 0.1F; step > 0.002F; step /= 2)
    for (bool moved = true; moved;) {
      const Point p = best;
      moved = attempt({p.x + step, p.y}) || attempt({p.x - step, p.y}) || attempt({p.x, p.y + step}) ||
              attempt({p.x, p.y - step});
    }
  return best;
}

AriefLight AriefView::light(double threshold) const {
  AriefLight out;
  cv::Mat dark, labels, stats, centroids;
  cv::compare(as_mat(grey_, width_, height_), cv::Scalar(threshold * level_), dark, cv::CMP_LT);
  cv::bitwise_and(dark, as_mat(ground_, width_, height_), dark);
  cv::morphologyEx(dark, dark, cv::MORPH_OPEN, disc(1));
  const int count = cv::connectedComponentsWithStats(dark, labels, stats, centroids, 8, CV_32S);
  std::vector<std::uint8_t> touches(static_cast<std::size_t>(count), 0);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      if (near_[static_cast<std::size_t>(y * width_ + x)] != 0)
        touches[static_cast<std::size_t>(labels.at<int>(y, x))] = 1;
  int chosen = 0, area = 0;
  for (int k = 1; k < count; ++k)
    if (touches[static_cast<std::size_t>(k)] != 0 && stats.at<int>(k, cv::CC_STAT_AREA) > area)
      chosen = k, area = stats.at<int>(k, cv::CC_STAT_AREA);
  if (area < kMinArea * body_px_) return out;

  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(labels == chosen, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  const std::vector<cv::Point>& contour = contours.front();
  const auto plane_at = [&](const cv::Point& p) { return plane_[static_cast<std::size_t>(p.y * width_ + p.x)]; };
  double twice = 0, sum_x = 0, sum_y = 0;
  std::vector<Point> edge;
  for (std::size_t k = 0; k < contour.size(); ++k) {
    const Point a = plane_at(contour[k]), b = plane_at(contour[(k + 1) % contour.size()]);
    const double cross = double{a.x} * b.y - double{b.x} * a.y;
    twice += cross;
    sum_x += cross * (a.x + b.x);
    sum_y += cross * (a.y + b.y);
    if (inner_[static_cast<std::size_t>(contour[k].y * width_ + contour[k].x)] != 0) edge.push_back(a);
  }
  if (edge.size() < kMinEdgePoints || twice == 0) return out;
  const double x = sum_x / (3 * twice), y = sum_y / (3 * twice), away = std::hypot(x, y);
  if (!(away > 0)) return out;
  const auto along = [&](double px, double py) { return (px * x + py * y) / away; };
  double tip = 0;
  for (const Point& p : edge) tip = std::max(tip, along(p.x, p.y));
  double per_height = std::numeric_limits<double>::infinity();
  for (const Vertex& v : vertices_)
    if (v.z > 0.01) per_height = std::min(per_height, (tip - along(v.x, v.y)) / v.z);
  if (!(per_height > 0)) return out;

  const Point line{static_cast<float>(per_height * x / away), static_cast<float>(per_height * y / away)};
  Observed seen;
  const std::size_t step = edge.size() / kMaxEdgePoints + 1;
  for (std::size_t k = 0; k < edge.size(); k += step) seen.edge.push_back(edge[k]);
  const int apart = 1 + static_cast<int>(std::sqrt(width_ * height_ / double{kMaxLitPoints}));
  for (int py = 0; py < height_; py += apart)
    for (int px = 0; px < width_; px += apart)
      if (inner_[static_cast<std::size_t>(py * width_ + px)] != 0 && labels.at<int>(py, px) != chosen)
        seen.lit.push_back(plane_at({px, py}));
  out.known = true;
  out.line = direction_of(line);
  out.contour = direction_of(fitted(seen, line));
  return out;
}

std::size_t arief_best_threshold(std::span<const AriefCase> cases, Vec3d AriefLight::*which) {
  std::array<double, kAriefThresholds> sums{};
  for (const AriefCase& one : cases)
    for (std::size_t k = 0; k < kAriefThresholds; ++k)
      sums[k] += one.lights[k].known ? angle_between(one.lights[k].*which, one.truth) : std::numbers::pi / 2;
  return static_cast<std::size_t>(std::min_element(sums.begin(), sums.end()) - sums.begin());
}

}  // namespace lightwell::bench
