#include "pose/tag_detector.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "pose/apriltag_family.hpp"
#include "pose/corner_refiner.hpp"
#include "pose/rectified_view.hpp"

namespace lightwell {

namespace {

/// Smallest side of a decimated picture, px: below it AprilTag, which works in tiles of 4 x 4 pixels, detects nothing.
constexpr int kMinSide_px = 32;
/// The centre of the top left pixel in AprilTag's coordinates.
constexpr double kApriltagCenter = 0.5;
/// Standard deviation of AprilTag's own corners, px; measured a few tenths, more with curved edges.
constexpr double kCoarseDeviation = 0.5;
/// Distance from AprilTag's straight edges within which the true ones are searched, px; the decimation is added to it.
constexpr double kEdgeSearchReach_px = 1.5;

PixelPosition middle_of(const std::array<PixelPosition, 4>& c) {
  return {(c[0].x + c[1].x + c[2].x + c[3].x) / 4, (c[0].y + c[1].y + c[2].y + c[3].y) / 4};
}

double reach_of(const std::array<PixelPosition, 4>& c) {
  const PixelPosition m = middle_of(c);
  double reach = 0;
  for (const PixelPosition p : c) reach = std::max(reach, std::hypot(p.x - m.x, p.y - m.y));
  return reach;
}

void sort(std::vector<TagDetection>& tags) {
  std::stable_sort(tags.begin(), tags.end(), [](const TagDetection& a, const TagDetection& b) {
    return std::pair(a.family, a.id) < std::pair(b.family, b.id);
  });
}

/// Whether two detections are of the same printed tag, not of two copies.
bool same_tag(const TagDetection& a, const TagDetection& b) {
  const PixelPosition ma = middle_of(a.corners), mb = middle_of(b.corners);
  return a.family == b.family && a.id == b.id &&
         std::hypot(ma.x - mb.x, ma.y - mb.y) < std::max(reach_of(a.corners), reach_of(b.corners));
}

/// Maps corners from the view to the original. False if a corner is not in the original, or an edge crosses the seam of
/// an equirectangular picture.
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

Status TagDetectorOptions::validate() const {
  const auto wrong = [](const std::string& what) { return Status(StatusCode::invalid_argument, what); };
  if (families.empty()) return wrong("families is empty; name at least one");
  for (std::size_t i = 0; i < families.size(); ++i)
    if (std::find(families.begin(), families.begin() + static_cast<std::ptrdiff_t>(i), families[i]) !=
        families.begin() + static_cast<std::ptrdiff_t>(i))
      return wrong("families names " + std::string(to_string(families[i])) + " twice");
  if (!(decimate >= 1 && decimate <= 8))
    return wrong("decimate is " + std::to_string(decimate) + "; it must be 1 to 8");
  if (!(blur_px >= 0 && blur_px <= 5)) return wrong("blur_px is " + std::to_string(blur_px) + "; it must be 0 to 5");
  if (min_contrast < 1 || min_contrast > 255)
    return wrong("min_contrast is " + std::to_string(min_contrast) + "; it must be 1 to 255");
  if (max_hamming < 0 || max_hamming > 2)
    return wrong("max_hamming is " + std::to_string(max_hamming) + "; it must be 0 to 2");
  if (!(min_decision_margin >= 0 && min_decision_margin <= 255))
    return wrong("min_decision_margin is " + std::to_string(min_decision_margin) + "; it must be 0 to 255");
  if (!linear.empty() && linear.size() != 256)
    return wrong("linear has " + std::to_string(linear.size()) + " values; it must have 256, or none");
  for (const float v : linear)
    if (!std::isfinite(v)) return wrong("linear has a value that is not finite");
  if (!(rectify_beyond_rad >= 0 && rectify_beyond_rad <= 4))
    return wrong("rectify_beyond_rad is " + std::to_string(rectify_beyond_rad) + "; it must be 0 to 4");
  if (threads < 1 || threads > 64) return wrong("threads is " + std::to_string(threads) + "; it must be 1 to 64");
  return {};
}

Status DetectionWindow::validate() const {
  TagDetectorOptions asked;
  asked.decimate = decimate;
  asked.min_contrast = min_contrast;
  const Status s = asked.validate();
  return s.ok() ? s : Status(s.code(), "tag detector: " + s.message());
}

struct TagDetector::Impl {
  TagDetectorOptions options;
  std::vector<std::pair<TagFamily, ApriltagFamily>> families;
  std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)> detector{nullptr, apriltag_detector_destroy};

  /// AprilTag's detections, not refined, in the pixel convention of TagDetection.
  [[nodiscard]] std::vector<TagDetection> detect_coarse(const GreyPicture& picture, double decimate,
                                                        int min_contrast) const;
  void refine(const GreyPicture& picture, TagDetection& tag, double decimate) const;
};

std::vector<TagDetection> TagDetector::Impl::detect_coarse(const GreyPicture& picture, double decimate,
                                                           int min_contrast) const {
  std::vector<TagDetection> out;
  if (std::min(picture.width, picture.height) < kMinSide_px * decimate) return out;
  detector->quad_decimate = static_cast<float>(decimate);
  detector->qtp.min_white_black_diff = min_contrast;
  // AprilTag does not write to the picture, but image_u8_t has a non-const pointer.
  image_u8_t image{picture.width, picture.height, static_cast<std::int32_t>(picture.stride),
                   const_cast<std::uint8_t*>(picture.data.data())};
  const std::unique_ptr<zarray_t, void (*)(zarray_t*)> found(apriltag_detector_detect(detector.get(), &image),
                                                             apriltag_detections_destroy);
  for (int i = 0; i < zarray_size(found.get()); ++i) {
    apriltag_detection_t* one = nullptr;
    zarray_get(found.get(), i, &one);
    if (one->decision_margin < options.min_decision_margin || one->hamming > options.max_hamming) continue;
    TagDetection tag;
    for (const auto& [family, held] : families)
      if (held.get() == one->family) tag.family = family;
    tag.id = one->id;
    tag.hamming = one->hamming;
    tag.decision_margin = static_cast<double>(one->decision_margin);
    const double variance = kCoarseDeviation * kCoarseDeviation * decimate * decimate;
    for (std::size_t k = 0; k < 4; ++k) {
      tag.corners[k] = {one->p[k][0] - kApriltagCenter, one->p[k][1] - kApriltagCenter};
      tag.covariance[k] = {variance, 0, variance};
    }
    out.push_back(tag);
  }
  return out;
}

void TagDetector::Impl::refine(const GreyPicture& picture, TagDetection& tag, double decimate) const {
  if (options.corners == CornerRefinement::none) return;
  const TagShape shape = shape_of(tag.family);
  const TagOutline outline{tag.corners, shape.edge_cells, shape.dark_inside};
  const auto corners =
      options.corners == CornerRefinement::edge_fit
          ? refine_corners(picture, outline, options.linear)
          : locate_corners_by_edge_search(picture, outline, options.linear, kEdgeSearchReach_px + decimate);
  tag.refined = true;
  for (std::size_t k = 0; k < 4; ++k) {
    if (corners[k]) {
      tag.corners[k] = corners[k]->position;
      tag.covariance[k] = corners[k]->covariance;
    } else {
      tag.refined = false;
    }
  }
}

TagDetector::TagDetector(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TagDetector::TagDetector(TagDetector&&) noexcept = default;
TagDetector& TagDetector::operator=(TagDetector&&) noexcept = default;
TagDetector::~TagDetector() = default;

Result<TagDetector> TagDetector::make(const TagDetectorOptions& options) {
  if (const Status s = options.validate(); !s.ok()) return Status(s.code(), "tag detector: " + s.message());
  auto impl = std::make_unique<Impl>();
  impl->options = options;
  impl->detector.reset(apriltag_detector_create());
  apriltag_detector_t& detector = *impl->detector;
  detector.nthreads = options.threads;
  detector.quad_decimate = static_cast<float>(options.decimate);
  detector.quad_sigma = static_cast<float>(options.blur_px);
  for (const TagFamily family : options.families) {
    impl->families.emplace_back(family, make_apriltag_family(family));
    apriltag_detector_add_family_bits(&detector, impl->families.back().second.get(), options.max_hamming);
  }
  return TagDetector(std::move(impl));
}

Result<std::vector<TagDetection>> TagDetector::detect(const GreyPicture& picture, const CameraModel* lens) {
  if (const Status s = picture.validate(); !s.ok()) return s;
  std::vector<TagDetection> tags = impl_->detect_coarse(picture, impl_->options.decimate, impl_->options.min_contrast);
  // Detections in rectified views of tags that were also found in the picture: a better start where edges are curved.
  std::vector<std::optional<TagDetection>> straight(tags.size());
  if (lens != nullptr) {
    for (const ViewAxes& axes : views_of(*lens, picture.width, picture.height, impl_->options.rectify_beyond_rad)) {
      const RectifiedView view(picture, *lens, axes);
      for (TagDetection tag :
           impl_->detect_coarse(view.picture(), impl_->options.decimate, impl_->options.min_contrast)) {
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
    impl_->refine(picture, tags[i], impl_->options.decimate);
    if (tags[i].refined || !straight[i]) continue;
    impl_->refine(picture, *straight[i], impl_->options.decimate);
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
  std::vector<TagDetection> tags = impl_->detect_coarse(part, window.decimate, window.min_contrast);
  for (TagDetection& tag : tags) {
    for (PixelPosition& p : tag.corners) p = {p.x + left, p.y + top};
    impl_->refine(picture, tag, window.decimate);
  }
  sort(tags);
  return tags;
}

}  // namespace lightwell
