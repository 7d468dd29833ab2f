#include "ar_viewer/tag_tracker.hpp"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <opencv2/calib3d.hpp>

#include <lightwell/glm.hpp>

extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
}

namespace lightwell::viewer {
namespace {

/// The centre of the top left pixel in libapriltag's coordinates.
constexpr double kApriltagCenter = 0.5;

struct Family {
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};
/// By TagFamily.
constexpr std::array<Family, kTagFamilies.size()> kFamilies = {{
    {&tag36h11_create, &tag36h11_destroy},
    {&tagStandard41h12_create, &tagStandard41h12_destroy},
    {&tag25h9_create, &tag25h9_destroy},
    {&tag16h5_create, &tag16h5_destroy},
}};

}  // namespace

struct TagTracker::Impl {
  TrackedTag tag;
  CameraModel camera;
  const Family* kind = nullptr;
  apriltag_family_t* family = nullptr;
  apriltag_detector_t* detector = nullptr;

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (detector != nullptr) apriltag_detector_destroy(detector);
    if (family != nullptr) kind->destroy(family);
  }

  /// T_tag_camera.
  [[nodiscard]] Pose pose_of(const apriltag_detection_t& detection) const {
    const double h = tag.size_m / 2;
    const std::vector<cv::Point3d> corners = {{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
    std::vector<cv::Point2d> pixels;  // libapriltag begins at the bottom left and goes round by the right.
    for (const std::size_t i : {3U, 2U, 1U, 0U})
      pixels.emplace_back(detection.p[i][0] - kApriltagCenter, detection.p[i][1] - kApriltagCenter);
    const cv::Mat k = (cv::Mat_<double>(3, 3) << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
    cv::Mat rotation_vector, translation, rotation;
    cv::solvePnP(corners, pixels, k, cv::noArray(), rotation_vector, translation, false, cv::SOLVEPNP_IPPE_SQUARE);
    cv::solvePnPRefineLM(corners, pixels, k, cv::noArray(), rotation_vector, translation);
    cv::Rodrigues(rotation_vector, rotation);
    glm::dmat4 T_cv_tag(1);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) T_cv_tag[column][row] = rotation.at<double>(row, column);
      T_cv_tag[3][row] = translation.at<double>(row);
    }
    // From OpenCV's camera (x right, y down, z forward) to ours: half a turn about x.
    const Pose T_camera_cv{{1, 0, 0, 0}, {}};
    return inverse(compose(T_camera_cv, from_glm(T_cv_tag)));
  }
};

TagTracker::TagTracker(const TrackedTag& tag, const CameraModel& camera) : impl_(std::make_unique<Impl>()) {
  impl_->tag = tag;
  impl_->camera = camera;
  impl_->kind = &kFamilies[static_cast<std::size_t>(tag.family)];
  impl_->family = impl_->kind->create();
  impl_->detector = apriltag_detector_create();
  impl_->detector->quad_decimate = 1;
  apriltag_detector_add_family(impl_->detector, impl_->family);
}
TagTracker::TagTracker(TagTracker&&) noexcept = default;
TagTracker& TagTracker::operator=(TagTracker&&) noexcept = default;
TagTracker::~TagTracker() = default;

std::optional<Pose> TagTracker::find(std::span<const std::uint8_t> grey) {
  const CameraModel& camera = impl_->camera;
  if (grey.size() != static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height))
    return std::nullopt;
  // libapriltag does not write to it.
  image_u8_t image{camera.width, camera.height, camera.width, const_cast<std::uint8_t*>(grey.data())};  // NOLINT
  zarray_t* detections = apriltag_detector_detect(impl_->detector, &image);
  apriltag_detection_t* found = nullptr;
  int count = 0;
  for (int i = 0; i < zarray_size(detections); ++i) {
    apriltag_detection_t* each = nullptr;
    zarray_get(detections, i, static_cast<void*>(&each));
    if (each->id != impl_->tag.id) continue;
    found = each;
    ++count;
  }
  std::optional<Pose> pose;
  if (count == 1) pose = compose(impl_->tag.T_world_tag, impl_->pose_of(*found));
  apriltag_detections_destroy(detections);
  return pose;
}

}  // namespace lightwell::viewer
