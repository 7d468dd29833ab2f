#include "estimate/specular/plane_capture.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "estimate/specular/plane_motion.hpp"

namespace lightwell::specular {
namespace {

/// Pixels around the plane that are read: the reach of the refinement.
constexpr double kMargin_px = 24;
/// A frame is stored if its relative error is below kMaxError (a picture of something else has about 1) and at most
/// this multiple of the usual one,
constexpr double kMaxError = 0.75;
constexpr double kMaxErrorRatio = 1.5;
constexpr double kErrorMargin = 0.2;
/// or after so many others that were not (five seconds): the light or the plane has changed.
constexpr int kMaxRejected = 150;
/// The covariance of refined poses is this multiple of the inverse of RefinedPose::information, plus the squares of the
/// others. Below 40 degrees of elevation it is 1 to 2 times that (measure_specular: variance_factor), above more: there
/// errors of the texture outweigh noise. The result hardly depends on it.
constexpr double kVarianceFactor = 10, kMinRotation_rad = 5e-4, kMinTranslation_m = 1e-4;
/// Frames without a refined pose after which it is not extrapolated.
constexpr std::uint32_t kMaxGap = 3;
/// Frames over which the usual error is averaged.
constexpr double kErrorMemory = 20;

}  // namespace

PlaneCapture::PlaneCapture(const RigParameters& rig, const CaptureOptions& options)
    : options_(options),
      warp_(rig, options.texels),
      refiner_(options.texels, options.refiner),
      light_field_(options.texels, options.levels, options.max_bytes),
      separation_(options.texels, options.lumisphere_levels),
      light_change_(options.texels) {}

CapturedFrame PlaneCapture::add(estimate::RowReader& reader, int lens, const UncertainPose& tag_pose,
                                std::uint32_t frame, double scale) {
  CapturedFrame out;
  out.pose.probe_plane = tag_pose.pose;
  out.visible = warp_.load(reader, lens, tag_pose.pose, kMargin_px, scale);
  if (!out.visible) return out;
  if (options_.refine_pose) {
    const Vec3d lens_now = warp_.lens_in_plane(tag_pose.pose);
    const UncertainPose prior{alignment().texture_pose(tag_pose.pose, lens_now), tag_pose.covariance};
    separation_.predict(lens_now, predicted_);
    out.pose = refiner_.refine(warp_, prior, extrapolated(frame), predicted_, image_);
    if (const auto change = light_change_.add(image_, view_from(out.pose.probe_plane), separation_.diffuse(), frame)) {
      restart(*change);
      return out;
    }
    if (!agrees(out.pose)) return out;
    if (out.pose.aligned && std::isfinite(out.pose.error_after)) add_to_alignment(tag_pose, out.pose);
    track_[0] = track_[1];
    track_[1] = {out.pose.probe_plane, frame, true};
  } else {
    warp_.sample(tag_pose.pose, image_);
  }
  out.stored = true;
  const ViewPoint from = view_from(out.pose.probe_plane);
  const auto first = light_field_.add(image_, from, frame);
  out.new_samples = first.size();
  separation_.add_to_medians(image_, first);
  separation_.add_clipped(image_, from.lens);
  (void)separation_.sweep(light_field_, options_.separation_samples);
  return out;
}

std::optional<Pose> PlaneCapture::extrapolated(std::uint32_t frame) const {
  const auto& [before, last] = track_;
  if (!last.valid || frame - last.frame > kMaxGap) return std::nullopt;
  if (!before.valid || last.frame - before.frame > kMaxGap) return last.pose;
  // The motion from `before` to `last`, in the plane's frame, continued for the time since.
  const double steps = static_cast<double>(frame - last.frame) / static_cast<double>(last.frame - before.frame);
  const Vector6 motion = steps * logarithm(compose(inverse(before.pose), last.pose));
  return compose(last.pose, exponential(motion));
}

bool PlaneCapture::agrees(const RefinedPose& pose) {
  // Nothing to compare with yet.
  if (!std::isfinite(pose.error_after)) return true;
  const double largest = std::min(kMaxError, kMaxErrorRatio * usual_error_ + kErrorMargin);
  if (usual_error_ > 0 && rejected_ < kMaxRejected && pose.error_after > largest) {
    ++rejected_;
    return false;
  }
  const double memory = rejected_ >= kMaxRejected || !(usual_error_ > 0) ? 1 : kErrorMemory;
  usual_error_ += (pose.error_after - usual_error_) / memory;
  rejected_ = 0;
  return true;
}

void PlaneCapture::restart(const LightChange::Change& change) {
  light_field_.remove_before(change.since);
  separation_.restart(static_cast<float>(change.gain));
  usual_error_ = 0;
  rejected_ = 0;
  ++restarts_;
}

Pose TextureAlignment::texture_pose(const Pose& probe_plane, Vec3d lens) const {
  Vector6 motion;
  motion << 0, 0, rotation_rad, x_m + scale * lens.x, y_m + scale * lens.y, scale * lens.z;
  return compose(probe_plane, exponential(motion));
}

void PlaneCapture::add_to_alignment(const UncertainPose& tag_pose, const RefinedPose& refined) {
  Matrix6 covariance = Matrix6::Identity();
  for (Eigen::Index r = 0; r < 6; ++r)
    for (Eigen::Index c = 0; c < 6; ++c)
      covariance(r, c) +=
          refined.information[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] / kVarianceFactor;
  covariance = covariance.inverse() + motion_covariance(tag_pose);
  for (Eigen::Index k = 0; k < 3; ++k)
    covariance(k, k) += kMinRotation_rad * kMinRotation_rad,
        covariance(k + 3, k + 3) += kMinTranslation_m * kMinTranslation_m;
  const Vector6 motion = logarithm(compose(inverse(tag_pose.pose), refined.probe_plane));
  const Vec3d lens = warp_.lens_in_plane(refined.probe_plane);
  // A scaled texture is seen from a distance scaled by the inverse: the plane moves along the ray from the lens. The
  // last two unknowns are the tilt: a tag's rotation and translation are correlated, and without them a tilt of all
  // refined poses by 0.02 degrees would be taken for an error of all tag poses that displaces them by 0.2 mm.
  Matrix6 design = Matrix6::Zero();
  design(3, 0) = design(4, 1) = design(2, 2) = design(0, 4) = design(1, 5) = 1;
  design(3, 3) = lens.x, design(4, 3) = lens.y, design(5, 3) = lens.z;
  const Matrix6 weighted = design.transpose() * covariance.inverse();
  const Matrix6 a = weighted * design;
  const Vector6 b = weighted * motion;
  for (std::size_t r = 0; r < 6; ++r) {
    for (std::size_t c = 0; c < 6; ++c) normal_[r][c] += a(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
    normal_[r][6] += b[static_cast<Eigen::Index>(r)];
  }
}

TextureAlignment PlaneCapture::alignment() const {
  Matrix6 a;
  Vector6 b;
  for (std::size_t r = 0; r < 6; ++r) {
    for (std::size_t c = 0; c < 6; ++c) a(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = normal_[r][c];
    b[static_cast<Eigen::Index>(r)] = normal_[r][6];
  }
  const auto solver = a.ldlt();
  if (!solver.isPositive() || !(solver.rcond() > 1e-12)) return {};
  const Vector6 x = solver.solve(b);
  return {x[0], x[1], x[2], x[3]};
}

}  // namespace lightwell::specular
