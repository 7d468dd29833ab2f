#include "pose/tag_detector.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <apriltag/apriltag.h>

#include "pose/corner_refiner.hpp"

namespace lightwell {

namespace {

/// Smallest side of a decimated picture, px: below it AprilTag, which works in tiles of 4 x 4 pixels, detects nothing.
constexpr int kMinSide_px = 32;
/// Number of corrected bits: more find more dirty tags, and more false ones; 2 takes 100 MB for tagStandard41h12.
constexpr int kMaxHamming = 1;
/// Detections with a smaller decision margin are dropped.
constexpr double kMinDecisionMargin = 10;
/// The centre of the top left pixel in AprilTag's coordinates.
constexpr double kApriltagCenter = 0.5;
/// Standard deviation of AprilTag's own corners, px: between the 0.1 px of a sharp straight edge and the 0.45 px of a
/// curved one. Proportional to a decimation above 2.
constexpr double kCoarseDeviation = 0.3;
/// Distance from AprilTag's straight edges within which the true ones are searched, px; the decimation is added to it.
constexpr double kEdgeSearchReach_px = 1.5;

/// AprilTag's decode_sharpening of an enlarged picture: cells of less than 2 px blur into each other.
constexpr double kEnlargedSharpening = 1;

/// Linear intensity, relative to full scale, below which Tones::logarithmic is nearly linear: that of ink in a shadow.
constexpr double kBlack = 0.01;

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kViewsPerRing = 8;
constexpr double kRingHalf = 40 * kDegree, kMiddleHalf = 45 * kDegree;
/// Largest angle of the first ring's centres from the axis, in the field of most lenses; larger fields have more rings.
constexpr double kRingCenter = 70 * kDegree, kRingStep = 50 * kDegree;
constexpr int kMaxSize_px = 1600;
constexpr std::uint8_t kGrey = 128;
/// The camera model is evaluated at the corners of blocks of this many pixels and interpolated bilinearly between them.
/// The error of some hundredths of a pixel does not matter, because corners are refined in the original picture.
constexpr int kBlock = 8;

Vec3d direction_cv(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

/// Resolution of the lens in a direction, px/rad: the larger of the radial and the tangential one.
std::optional<double> density(const CameraModel& lens, double theta, double phi) {
  const Vec3d ahead = direction_cv(theta, phi);
  const Vec3d radial = direction_cv(theta + std::numbers::pi / 2, phi), around = cross(ahead, radial);
  constexpr double kStep = 1e-3;
  double best = 0;
  for (const Vec3d aside : {radial, around}) {
    const auto a = lens.project(ahead - aside * kStep), b = lens.project(ahead + aside * kStep);
    if (!a || !b) return std::nullopt;
    best = std::max(best, std::hypot(b->x - a->x, b->y - a->y) / (2 * kStep));
  }
  return best > 0 ? std::optional(best) : std::nullopt;
}

std::optional<ViewAxes> view_towards(const CameraModel& lens, double theta, double phi, double half) {
  const auto focal = density(lens, theta, phi);
  if (!focal) return std::nullopt;
  ViewAxes view;
  view.forward = direction_cv(theta, phi);
  // "Down" points away from the axis; any choice will do, because tags are detected in any orientation.
  view.down = direction_cv(theta + std::numbers::pi / 2, phi);
  view.right = cross(view.down, view.forward);
  const double wanted = 2 * *focal * std::tan(half);
  view.size = static_cast<int>(std::clamp(wanted, 16.0, static_cast<double>(kMaxSize_px)));
  view.focal_px = *focal * view.size / wanted;
  return view;
}

/// The largest angle from the axis that the picture shows, rad; the model's limit where its rim lies in the picture.
double largest_angle(const CameraModel& lens, int width, int height) {
  const double end = lens.max_angle_rad();
  constexpr int kSteps = 64;
  double seen = 0;
  const auto include = [&](double x, double y) {
    if (const auto d = lens.unproject({x, y})) seen = std::max(seen, std::atan2(std::hypot(d->x, d->y), d->z));
  };
  for (int i = 0; i <= kSteps; ++i) {
    const double x = (width - 1.0) * i / kSteps, y = (height - 1.0) * i / kSteps;
    include(x, 0), include(x, height - 1.0), include(0, y), include(width - 1.0, y);
  }
  // The rim of the field of view may lie in the picture all around, or in a part of it.
  for (int i = 0; i < kSteps; ++i) {
    const auto p = lens.project(direction_cv(end * (1 - 1e-9), 2 * std::numbers::pi * i / kSteps));
    if (p && p->x >= 0 && p->y >= 0 && p->x <= width - 1 && p->y <= height - 1) return end;
  }
  return seen;
}

std::uint8_t sampled(const GreyPicture& picture, PixelPosition p) {
  const double fx = std::floor(p.x), fy = std::floor(p.y);
  if (!(fx >= 0 && fy >= 0 && fx < picture.width - 1 && fy < picture.height - 1)) return kGrey;
  const int x = static_cast<int>(fx), y = static_cast<int>(fy);
  const double u = p.x - fx, v = p.y - fy;
  const double value = (1 - v) * ((1 - u) * picture.at(x, y) + u * picture.at(x + 1, y)) +
                       v * ((1 - u) * picture.at(x, y + 1) + u * picture.at(x + 1, y + 1));
  return static_cast<std::uint8_t>(value + 0.5);
}

class RectifiedView {
 public:
  /// Pixels outside the field of view or the picture are grey (128).
  RectifiedView(const GreyPicture& picture, const CameraModel& lens, const ViewAxes& axes)
      : axes_(axes), pixels_(static_cast<std::size_t>(axes.size) * static_cast<std::size_t>(axes.size), kGrey) {
    const auto at = [&](int x, int y) { return original(lens, {static_cast<double>(x), static_cast<double>(y)}); };
    for (int top = 0; top < axes.size; top += kBlock)
      for (int left = 0; left < axes.size; left += kBlock) {
        const auto a = at(left, top), b = at(left + kBlock, top), c = at(left, top + kBlock),
                   d = at(left + kBlock, top + kBlock);
        const bool smooth = a && b && c && d;
        for (int y = top; y < std::min(top + kBlock, axes.size); ++y)
          for (int x = left; x < std::min(left + kBlock, axes.size); ++x) {
            std::optional<PixelPosition> p;
            if (smooth) {
              const double u = static_cast<double>(x - left) / kBlock, v = static_cast<double>(y - top) / kBlock;
              const double wa = (1 - u) * (1 - v), wb = u * (1 - v), wc = (1 - u) * v, wd = u * v;
              p = PixelPosition{wa * a->x + wb * b->x + wc * c->x + wd * d->x,
                                wa * a->y + wb * b->y + wc * c->y + wd * d->y};
            } else if (a || b || c || d) {
              p = at(x, y);
            }
            if (p) pixels_[static_cast<std::size_t>(y * axes.size + x)] = sampled(picture, *p);
          }
      }
  }

  [[nodiscard]] GreyPicture picture() const {
    return {pixels_, axes_.size, axes_.size, static_cast<std::size_t>(axes_.size)};
  }

  /// Maps a pixel of the view to the original picture; nullopt outside the field of view.
  [[nodiscard]] std::optional<PixelPosition> original(const CameraModel& lens, PixelPosition in_view) const {
    const double middle = (axes_.size - 1) / 2.0;
    return lens.project(axes_.forward * axes_.focal_px + axes_.right * (in_view.x - middle) +
                        axes_.down * (in_view.y - middle));
  }

 private:
  ViewAxes axes_;
  std::vector<std::uint8_t> pixels_;
};

PixelPosition middle_of(const std::array<PixelPosition, 4>& c) {
  return {(c[0].x + c[1].x + c[2].x + c[3].x) / 4, (c[0].y + c[1].y + c[2].y + c[3].y) / 4};
}

double reach_of(const std::array<PixelPosition, 4>& c) {
  const PixelPosition m = middle_of(c);
  double reach = 0;
  for (const PixelPosition p : c) reach = std::max(reach, std::hypot(p.x - m.x, p.y - m.y));
  return reach;
}

/// Value a quarter of a pixel from b towards c, from successive pixels a to d: Catmull-Rom weights (Keys 1981, "Cubic
/// convolution interpolation for digital image processing", a = -1/2), in 1/128.
std::uint8_t interpolated(int a, int b, int c, int d) {
  return static_cast<std::uint8_t>(std::clamp((-9 * a + 111 * b + 29 * c - 3 * d + 64) >> 7, 0, 255));
}

/// Doubles the columns of `in`: pixel X of the result is centred at (X - 0.5) / 2 of `in`. Pixels beyond the border are
/// those of the border.
void enlarge_row(std::span<const std::uint8_t> in, std::span<std::uint8_t> out) {
  const auto at = [&](std::size_t x, int step) -> int {
    return in[static_cast<std::size_t>(
        std::clamp(static_cast<std::ptrdiff_t>(x) + step, std::ptrdiff_t{0}, std::ssize(in) - 1))];
  };
  for (std::size_t x = 0; x < in.size(); ++x) {
    out[2 * x] = interpolated(at(x, 1), at(x, 0), at(x, -1), at(x, -2));
    out[2 * x + 1] = interpolated(at(x, -1), at(x, 0), at(x, 1), at(x, 2));
  }
}

/// `picture` with twice the columns and rows, in `bytes`.
GreyPicture enlarged(const GreyPicture& picture, std::vector<std::uint8_t>& bytes) {
  const auto width = static_cast<std::size_t>(picture.width), height = static_cast<std::size_t>(picture.height);
  std::vector<std::uint8_t> wide(2 * width * height);
  for (std::size_t y = 0; y < height; ++y)
    enlarge_row(picture.data.subspan(y * picture.stride, width), std::span(wide).subspan(2 * width * y, 2 * width));
  bytes.resize(4 * width * height);
  const auto row = [&](std::size_t y, int step) {
    const auto clamped = std::clamp(static_cast<int>(y) + step, 0, picture.height - 1);
    return wide.data() + 2 * width * static_cast<std::size_t>(clamped);
  };
  for (std::size_t y = 0; y < height; ++y)
    for (const int side : {-1, 1}) {
      const std::uint8_t *a = row(y, -side), *b = row(y, 0), *c = row(y, side), *d = row(y, 2 * side);
      std::uint8_t* out = bytes.data() + 2 * width * (2 * y + (side > 0 ? 1 : 0));
      for (std::size_t x = 0; x < 2 * width; ++x) out[x] = interpolated(a[x], b[x], c[x], d[x]);
    }
  return {bytes, 2 * picture.width, 2 * picture.height, 2 * width};
}

/// Tones::logarithmic, in `bytes`. `linear`: as TagDetectorOptions::linear.
GreyPicture logarithm_of(const GreyPicture& picture, std::span<const float> linear, std::vector<std::uint8_t>& bytes) {
  std::array<std::uint8_t, 256> curve{};
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const double intensity = linear.empty() ? static_cast<double>(i) / 255 : std::clamp<double>(linear[i], 0, 1);
    curve[i] = static_cast<std::uint8_t>(std::lround(255 * std::log1p(intensity / kBlack) / std::log1p(1 / kBlack)));
  }
  const auto width = static_cast<std::size_t>(picture.width), height = static_cast<std::size_t>(picture.height);
  bytes.resize(width * height);
  for (std::size_t y = 0; y < height; ++y)
    std::ranges::transform(picture.data.subspan(y * picture.stride, width), bytes.data() + y * width,
                           [&](std::uint8_t value) { return curve[value]; });
  return {bytes, picture.width, picture.height, width};
}

void sort(std::vector<TagDetection>& tags) {
  std::ranges::stable_sort(tags, {}, [](const TagDetection& t) { return std::pair(t.family, t.id); });
}

/// Whether two detections are of the same printed tag, not of two copies.
bool same_tag(const TagDetection& a, const TagDetection& b) {
  const PixelPosition ma = middle_of(a.corners), mb = middle_of(b.corners);
  return a.family == b.family && a.id == b.id &&
         std::hypot(ma.x - mb.x, ma.y - mb.y) < std::max(reach_of(a.corners), reach_of(b.corners));
}

/// Maps corners from the view to the original. False if one is not in it, or an edge crosses an equirectangular seam.
bool to_original(const RectifiedView& view, const CameraModel& lens, std::array<PixelPosition, 4>& corners) {
  std::array<PixelPosition, 4> out;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = view.original(lens, corners[i]);
    if (!p) return false;
    out[i] = *p;
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const PixelPosition a = corners[i], b = corners[(i + 1) % 4], oa = out[i], ob = out[(i + 1) % 4];
    const auto middle = view.original(lens, {(a.x + b.x) / 2, (a.y + b.y) / 2});
    if (!middle) return false;
    const double off = std::hypot(middle->x - (oa.x + ob.x) / 2, middle->y - (oa.y + ob.y) / 2);
    if (off > 0.25 * std::hypot(oa.x - ob.x, oa.y - ob.y)) return false;
  }
  corners = out;
  return true;
}

}  // namespace

std::vector<ViewAxes> views_of(const CameraModel& lens, int width, int height, double beyond_rad) {
  std::vector<ViewAxes> views;
  const double end = largest_angle(lens, width, height);
  if (!(end > beyond_rad)) return views;
  if (const auto middle = view_towards(lens, 0, 0, kMiddleHalf)) views.push_back(*middle);
  for (double theta = std::clamp(end - 20 * kDegree, 35 * kDegree, kRingCenter);; theta += kRingStep) {
    for (int i = 0; i < kViewsPerRing; ++i)
      if (const auto view = view_towards(lens, theta, 2 * std::numbers::pi * i / kViewsPerRing, kRingHalf))
        views.push_back(*view);
    if (theta + kRingHalf >= end) break;
  }
  return views;
}

Status TagDetectorOptions::validate() const {
  if (families.empty()) return invalid_argument("families is empty; name at least one");
  for (std::size_t i = 0; i < families.size(); ++i)
    if (std::find(families.begin(), families.begin() + static_cast<std::ptrdiff_t>(i), families[i]) !=
        families.begin() + static_cast<std::ptrdiff_t>(i))
      return invalid_argument("families names " + std::string(to_string(families[i])) + " twice");
  if (!linear.empty() && linear.size() != 256)
    return invalid_argument("linear has " + std::to_string(linear.size()) + " values; it must have 256, or none");
  for (const float v : linear)
    if (!std::isfinite(v)) return invalid_argument("linear has a value that is not finite");
  return {};
}

Status DetectionWindow::validate() const {
  const auto wrong = [](const std::string& what) { return invalid_argument("tag detector: " + what); };
  if (decimate != kEnlarged && !(decimate >= 1 && decimate <= 8))
    return wrong("decimate is " + std::to_string(decimate) + "; it must be 0.5, or 1 to 8");
  if (min_contrast < 1 || min_contrast > 255)
    return wrong("min_contrast is " + std::to_string(min_contrast) + "; it must be 1 to 255");
  return {};
}

std::vector<TagDetection> TagDetector::detect_coarse(const GreyPicture& picture, const DetectionWindow& search) const {
  std::vector<TagDetection> out;
  if (std::min(picture.width, picture.height) < kMinSide_px * search.decimate) return out;
  detector_->quad_decimate = static_cast<float>(search.decimate);
  detector_->qtp.min_white_black_diff = search.min_contrast;
  // AprilTag does not write to the picture, but image_u8_t has a non-const pointer.
  image_u8_t image{picture.width, picture.height, static_cast<std::int32_t>(picture.stride),
                   const_cast<std::uint8_t*>(picture.data.data())};
  const std::unique_ptr<zarray_t, void (*)(zarray_t*)> found(apriltag_detector_detect(detector_.get(), &image),
                                                             apriltag_detections_destroy);
  for (int i = 0; i < zarray_size(found.get()); ++i) {
    apriltag_detection_t* one = nullptr;
    zarray_get(found.get(), i, &one);
    if (static_cast<double>(one->decision_margin) < kMinDecisionMargin || one->hamming > kMaxHamming) continue;
    TagDetection tag;
    for (const auto& [family, held] : families_)
      if (held.get() == one->family) tag.family = family;
    tag.id = one->id;
    tag.hamming = one->hamming;
    tag.decision_margin = static_cast<double>(one->decision_margin);
    const double deviation = kCoarseDeviation * std::max(1.0, search.decimate / 2), variance = deviation * deviation;
    for (std::size_t k = 0; k < 4; ++k) {
      tag.corners[k] = {one->p[k][0] - kApriltagCenter, one->p[k][1] - kApriltagCenter};
      tag.covariance[k] = {variance, 0, variance};
    }
    out.push_back(tag);
  }
  return out;
}

std::vector<TagDetection> TagDetector::detect_enlarged(const GreyPicture& picture, DetectionWindow search) const {
  search.decimate = 1;
  const double usual = detector_->decode_sharpening;
  detector_->decode_sharpening = kEnlargedSharpening;
  std::vector<std::uint8_t> bytes;
  std::vector<TagDetection> tags = detect_coarse(enlarged(picture, bytes), search);
  detector_->decode_sharpening = usual;
  for (TagDetection& tag : tags)
    for (PixelPosition& p : tag.corners) p = {(p.x - 0.5) / 2, (p.y - 0.5) / 2};
  return tags;
}

void TagDetector::refine(const GreyPicture& picture, TagDetection& tag, double decimate) const {
  if (options_.corners == CornerRefinement::none) return;
  const TagShape shape = shape_of(tag.family);
  const TagOutline outline{tag.corners, shape.edge_cells, shape.dark_inside};
  const RefinedTag found =
      options_.corners == CornerRefinement::edge_fit
          ? refine_corners(picture, outline, options_.linear)
          : locate_corners_by_edge_search(picture, outline, options_.linear, kEdgeSearchReach_px + decimate);
  tag.blur_px = found.blur_px;
  tag.refined = true;
  for (std::size_t k = 0; k < 4; ++k) {
    if (const std::optional<RefinedCorner>& corner = found.corners[k]) {
      tag.corners[k] = corner->position;
      tag.covariance[k] = corner->covariance;
    } else {
      tag.refined = false;
    }
  }
}

Result<TagDetector> TagDetector::make(const TagDetectorOptions& options) {
  if (const Status s = options.validate(); !s.ok()) return Status(s.code(), "tag detector: " + s.message());
  TagDetector out;
  out.options_ = options;
  out.detector_ = {apriltag_detector_create(), apriltag_detector_destroy};
  for (const TagFamily family : options.families) {
    out.families_.emplace_back(family, make_apriltag_family(family));
    apriltag_detector_add_family_bits(out.detector_.get(), out.families_.back().second.get(), kMaxHamming);
  }
  return out;
}

Result<std::vector<TagDetection>> TagDetector::detect(const GreyPicture& picture, const CameraModel* lens) {
  if (const Status s = picture.validate(); !s.ok()) return s;
  std::vector<TagDetection> tags = detect_coarse(picture);
  // Detections in rectified views of tags that were also found in the picture: a better start where edges are curved.
  std::vector<std::optional<TagDetection>> straight(tags.size());
  if (lens != nullptr) {
    for (const ViewAxes& axes : views_of(*lens, picture.width, picture.height, kRectifyBeyond_rad)) {
      const RectifiedView view(picture, *lens, axes);
      for (TagDetection tag : detect_coarse(view.picture())) {
        tag.rectified = true;
        if (!to_original(view, *lens, tag.corners)) continue;
        const auto known = std::find_if(tags.begin(), tags.end(), [&](const auto& t) { return same_tag(t, tag); });
        if (known == tags.end()) {
          tags.push_back(tag);
          straight.emplace_back();
        } else if (known->rectified && known->decision_margin < tag.decision_margin) {
          *known = tag;
        } else if (!known->rectified) {
          straight[static_cast<std::size_t>(known - tags.begin())] = tag;
        }
      }
    }
  }
  for (std::size_t i = 0; i < tags.size(); ++i) {
    refine(picture, tags[i]);
    if (tags[i].refined || !straight[i]) continue;
    refine(picture, *straight[i]);
    if (straight[i]->refined) tags[i] = *straight[i];
  }
  sort(tags);
  return tags;
}

Result<std::vector<TagDetection>> TagDetector::detect_in(const GreyPicture& picture, const DetectionWindow& window) {
  if (const Status s = picture.validate(); !s.ok()) return s;
  if (const Status s = window.validate(); !s.ok()) return s;
  const PixelRegion& region = window.region;
  const int left = std::max(region.x, 0), top = std::max(region.y, 0);
  // The sum of arbitrary values from a caller may overflow an int.
  const auto end = [](int first, int size, int limit) {
    return static_cast<int>(std::min<std::int64_t>(std::int64_t{first} + size, limit));
  };
  const int right = end(region.x, region.width, picture.width), bottom = end(region.y, region.height, picture.height);
  if (right <= left || bottom <= top) return std::vector<TagDetection>();
  const std::size_t first = static_cast<std::size_t>(top) * picture.stride + static_cast<std::size_t>(left);
  const GreyPicture part{picture.data.subspan(first), right - left, bottom - top, picture.stride};
  std::vector<std::uint8_t> bytes;
  const GreyPicture toned = window.tones == Tones::logarithmic ? logarithm_of(part, options_.linear, bytes) : part;
  std::vector<TagDetection> tags =
      window.decimate == kEnlarged ? detect_enlarged(toned, window) : detect_coarse(toned, window);
  for (TagDetection& tag : tags) {
    for (PixelPosition& p : tag.corners) p = {p.x + left, p.y + top};
    refine(picture, tag, window.decimate);
  }
  sort(tags);
  return tags;
}

}  // namespace lightwell
