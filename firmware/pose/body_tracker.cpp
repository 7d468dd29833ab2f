#include "pose/body_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace lightwell {

namespace {

Status wrong(const std::string& what) { return invalid_argument("body tracker: " + what); }

/// The pose with the covariance of the noise that is independent between frames, without the focal length error.
UncertainPose without_common_errors(const BodyPose& pose, double focal_sigma) {
  UncertainPose out = pose.probe_body;
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t k = 0; k < 6; ++k)
      out.covariance[i][k] -=
          focal_sigma * focal_sigma * pose.focal_jacobian[i] * pose.focal_jacobian[k] + pose.face_covariance[i][k];
  return out;
}

/// Mean variance of three of the six pose parameters, from index `first` on.
double mean_variance(const PoseCovariance& c, std::size_t first) {
  return (c[first][first] + c[first + 1][first + 1] + c[first + 2][first + 2]) / 3;
}

/// The rotation vector (axis times angle, rad) of a * b^-1, in the frame that both rotations map into.
Vec3d turn_between(Quat a, Quat b) {
  Quat q = a * b.inverse();
  if (q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
  const Vec3d v{q.x, q.y, q.z};
  const double sine = length(v);
  return sine > 1e-12 ? v * (2 * std::atan2(sine, q.w) / sine) : v * 2.0;
}

/// `q` followed by the rotation vector `by`, rad.
Quat turned(Vec3d by, Quat q) {
  const double angle = length(by);
  return angle > 0 ? (Quat::about(normalized(by), angle) * q).normalized() : q;
}

/// Kalman prediction over `seconds` and update of one velocity; `measured` is a pose difference divided by `seconds`.
void apply_measurement(Vec3d& velocity, double& variance, Vec3d measured, double measured_variance, double acceleration,
                       double seconds) {
  variance += acceleration * acceleration * seconds * seconds;
  const double gain = variance / (variance + measured_variance);
  velocity += (measured - velocity) * gain;
  variance *= 1 - gain;
}

/// Standard deviations of the motion model. Larger values widen the search region and allow faster motion.
constexpr double kInitialSpeedSigma_m_per_s = 0.4, kInitialTurnSigma_rad_per_s = 2;  // Until the second observation.
/// Process noise: a hand that starts or stops to move, and to turn.
constexpr double kAccelerationSigma_m_per_s2 = 6, kAccelerationSigma_rad_per_s2 = 40;

/// Constant velocity of the body's origin and constant angular velocity, both in the probe frame. Each velocity has a
/// Kalman filter with one variance for all three axes (Bar-Shalom et al. 2001, section 6.2, white noise acceleration).
class BodyMotion {
 public:
  /// `observation` is T_probe_body with the covariance of the noise that is independent between frames, without the
  /// focal length error, which is common to all frames. Of two observations of the same time (two lenses) the one with
  /// the smaller rotation variance is kept. An observation older than the last one restarts the filter.
  void update(ProbeTime time, const UncertainPose& observation, bool attitude_known) {
    if (!last_ || time < last_->time) {
      last_ = State{time, {observation, attitude_known}};
      return;
    }
    const PoseCovariance &now = observation.covariance, &before = last_->observed.probe_body.covariance;
    const double seconds = (time - last_->time).seconds();
    if (!(seconds > 0)) {
      if (mean_variance(now, 0) < mean_variance(before, 0)) last_->observed = {observation, attitude_known};
      return;
    }
    State next{time, {observation, attitude_known}};
    next.speed = last_->speed;
    next.speed_variance = last_->speed_variance;
    const Pose &here = observation.pose, &there = last_->observed.probe_body.pose;
    const double per = 1 / seconds;
    apply_measurement(next.speed, next.speed_variance, (here.translation - there.translation) * per,
                      (mean_variance(now, 3) + mean_variance(before, 3)) * per * per, kAccelerationSigma_m_per_s2,
                      seconds);
    // A rotation from or to an ambiguous attitude is no measurement of the angular velocity.
    if (attitude_known && last_->observed.attitude_known) {
      next.turn = last_->turn;
      next.turn_variance = last_->turn_variance;
      apply_measurement(next.turn, next.turn_variance, turn_between(here.rotation, there.rotation) * per,
                        (mean_variance(now, 0) + mean_variance(before, 0)) * per * per, kAccelerationSigma_rad_per_s2,
                        seconds);
    }
    last_ = next;
  }

  void reset() { last_.reset(); }

  /// The predicted pose; nullopt before the first observation, or for a time before the last one.
  [[nodiscard]] std::optional<BodyPrediction> predict(ProbeTime time) const {
    if (!last_ || time < last_->time) return std::nullopt;
    const double t = (time - last_->time).seconds();
    BodyPrediction out = last_->observed;
    out.probe_body.pose.translation += last_->speed * t;
    out.probe_body.pose.rotation = turned(last_->turn * t, out.probe_body.pose.rotation);
    // Variance from the velocity, and from an acceleration that began with the last frame.
    const auto grown = [&](double variance, double acceleration) {
      const double more = acceleration * t * t;
      return variance * t * t + more * more;
    };
    const double rotation = grown(last_->turn_variance, kAccelerationSigma_rad_per_s2),
                 translation = grown(last_->speed_variance, kAccelerationSigma_m_per_s2);
    for (std::size_t i = 0; i < 3; ++i) {
      out.probe_body.covariance[i][i] += rotation;
      out.probe_body.covariance[i + 3][i + 3] += translation;
    }
    return out;
  }

 private:
  struct State {
    ProbeTime time;
    BodyPrediction observed;
    Vec3d speed{}, turn{};  ///< m/s, rad/s.
    double speed_variance = kInitialSpeedSigma_m_per_s * kInitialSpeedSigma_m_per_s;
    double turn_variance = kInitialTurnSigma_rad_per_s * kInitialTurnSigma_rad_per_s;
  };

  std::optional<State> last_;
};

constexpr double kDegree = std::numbers::pi / 180;
/// Angle between a tag's normal and the line of sight beyond which tags are hardly detected.
constexpr double kOnEdge = 80 * kDegree;
/// Tags beyond this angle do not limit the decimation: they add little to the pose.
constexpr double kMaxViewAngle_rad = 70 * kDegree;
/// Smaller tags, relative to the largest, do not limit the decimation: they cost more time than they add accuracy. Tags
/// next to a dodecahedron's face that is seen head-on have a relative width of 0.45.
constexpr double kMinRelativeTagSize = 0.4;
constexpr double kSearchSigmas = 3;
/// Margin around a tag for AprilTag and the blur of its edges, px.
constexpr double kMargin = 4;

struct BodyView {
  /// Contains all tags that may face the lens, with a margin of three standard deviations; clipped to the picture.
  PixelRegion region;
  double cell_px = 0;  ///< Shorter side of a cell of the smallest tag that needs to be found.
};

/// Which of a body's tags (body frame) a lens will see; nullopt where none faces the lens and lies in its picture.
std::optional<BodyView> view_of(const PosedLens& lens, std::span<const WorldTag> tags,
                                const UncertainPose& probe_body) {
  const Pose lens_body = compose(inverse(lens.probe_lens), probe_body.pose);
  const PoseCovariance& c = probe_body.covariance;
  const double turn = kSearchSigmas * std::sqrt(std::max({c[0][0], c[1][1], c[2][2]}));
  // Position variance across the line of sight only: the sum over the two perpendicular axes.
  const Vec3d sight = normalized(probe_body.pose.translation - lens.probe_lens.translation);
  double across = 0;
  for (const Vec3d axis : tangent_basis(sight)) {
    const std::array<double, 3> a = {axis.x, axis.y, axis.z};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) across += a[i] * c[i + 3][k + 3] * a[k];
  }
  const double shift = kSearchSigmas * std::sqrt(std::max(across, 0.0));

  double left = std::numeric_limits<double>::infinity(), right = -left, top = left, bottom = -left;
  double px_per_m = 0, radius = 0;
  std::vector<double> cells;
  for (const WorldTag& tag : tags) {
    const Pose lens_tag = compose(lens_body, tag.world_tag);
    const double off = angle_between(rotate(lens_tag.rotation, Vec3d{0, 0, 1}), -lens_tag.translation);
    if (off > kOnEdge + turn) continue;
    const TagShape shape = shape_of(tag.family);
    const auto project = [&](double size_m, std::array<PixelPosition, 4>& out) {
      const auto at = tag_corners(size_m);
      for (std::size_t i = 0; i < 4; ++i) {
        const auto p = lens.model.project(transformed(lens_tag, at[i]));
        if (!p) return false;
        out[i] = *p;
      }
      return true;
    };
    std::array<PixelPosition, 4> paper, edge;
    if (!project(tag.size_m * shape.cells / shape.edge_cells, paper) || !project(tag.size_m, edge)) continue;
    radius = std::max(radius, length(tag.world_tag.translation));
    double shortest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 4; ++i) {
      left = std::min(left, paper[i].x);
      right = std::max(right, paper[i].x);
      top = std::min(top, paper[i].y);
      bottom = std::max(bottom, paper[i].y);
      const PixelPosition a = edge[i], b = edge[(i + 1) % 4];
      const double side = std::hypot(a.x - b.x, a.y - b.y);
      shortest = std::min(shortest, side);
      px_per_m = std::max(px_per_m, side / tag.size_m);
    }
    if (off < kMaxViewAngle_rad) cells.push_back(shortest / shape.edge_cells);
  }
  if (!(left < right)) return std::nullopt;
  const double margin = kMargin + px_per_m * (shift + std::min(turn, 1.0) * radius);
  left -= margin;
  right += margin;
  top -= margin;
  bottom += margin;
  if (!(right > 0 && bottom > 0 && left < lens.width - 1 && top < lens.height - 1)) return std::nullopt;
  BodyView out;
  const auto pixel = [](double v, int most) { return static_cast<int>(std::clamp(v, 0.0, static_cast<double>(most))); };
  out.region.x = pixel(std::floor(left), lens.width);
  out.region.y = pixel(std::floor(top), lens.height);
  out.region.width = pixel(std::ceil(right) + 1, lens.width) - out.region.x;
  out.region.height = pixel(std::ceil(bottom) + 1, lens.height) - out.region.y;
  if (!cells.empty()) {
    const double largest = *std::max_element(cells.begin(), cells.end());
    out.cell_px = largest;
    for (const double cell : cells)
      if (cell > kMinRelativeTagSize * largest) out.cell_px = std::min(out.cell_px, cell);
  }
  return out;
}

/// The largest decimation at which AprilTag still finds tags with cells of `cell_px`.
double decimation_for(double cell_px) {
  // AprilTag subsamples for integer d and averages for 1.5, which finds nearly all tags in a quarter of the time.
  for (const double d : {4.0, 3.0, 2.0})
    if (cell_px >= 3.5 * d) return d;
  if (cell_px >= 2.5 * 1.5) return 1.5;
  return cell_px >= 2.5 ? 1 : kEnlarged;
}

/// Whether a search that found nothing is repeated in the enlarged picture and by its logarithm: that searches six
/// times as many pixels in all, and a camera may look for hours at a place without the body.
bool search_thoroughly(int misses) { return misses % 8 == 0; }

}  // namespace

Status BodyTrackerOptions::validate() const {
  if (const Status s = pose.validate(); !s.ok()) return s;
  if (!(search_decimate >= 1 && search_decimate <= 8))
    return wrong("search_decimate is " + std::to_string(search_decimate) + "; it must be 1 to 8");
  if (!(decimate == 0 || (decimate >= 1 && decimate <= 8)))
    return wrong("decimate is " + std::to_string(decimate) + "; it must be 0, or 1 to 8");
  if (lost_after < 1 || lost_after > 1000)
    return wrong("lost_after is " + std::to_string(lost_after) + "; it must be 1 to 1,000");
  return {};
}

struct BodyTracker::Impl {
  MarkerBody body;
  PosedLenses rig;
  BodyTrackerOptions options;
  std::vector<WorldTag> tags;
  TagDetector detector;
  BodyMotion motion;
  std::vector<bool> seen;          ///< By lens: whether its last picture showed the body.
  int misses = 0;                  ///< Consecutive pictures without the body.
  Tones tones = Tones::unchanged;  ///< Of the last search.
};

BodyTracker::BodyTracker(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BodyTracker::BodyTracker(BodyTracker&&) noexcept = default;
BodyTracker& BodyTracker::operator=(BodyTracker&&) noexcept = default;
BodyTracker::~BodyTracker() = default;

Result<BodyTracker> BodyTracker::make(const MarkerBody& body, const RigParameters& rig,
                                      const BodyTrackerOptions& options) {
  if (const Status s = body.validate(); !s.ok()) return s;
  if (const Status s = rig.validate(); !s.ok()) return s;
  if (const Status s = options.validate(); !s.ok()) return s;
  Result<std::vector<WorldTag>> tags = tags_of(body);
  if (!tags) return tags.status();
  TagDetectorOptions detect;
  detect.families = {tags->front().family};
  detect.corners = options.corners;
  detect.linear = options.linear;
  Result<TagDetector> detector = TagDetector::make(detect);
  if (!detector) return detector.status();
  return BodyTracker(std::make_unique<Impl>(Impl{
      body, rig, options, std::move(*tags), std::move(*detector), {}, std::vector<bool>(rig.lenses.size(), false)}));
}

void BodyTracker::set_decimation(double search_decimate, double decimate) {
  impl_->options.search_decimate = search_decimate;
  impl_->options.decimate = decimate;
}

void BodyTracker::reset() {
  impl_->motion.reset();
  impl_->seen.assign(impl_->seen.size(), false);
  impl_->misses = 0;
}

Result<BodyObservation> BodyTracker::track(const GreyPicture& picture, ProbeTime mid_exposure, int lens) {
  if (const Status s = picture.validate(); !s.ok()) return s;
  Impl& in = *impl_;
  if (!in.rig.has(lens))
    return wrong("there is no lens " + std::to_string(lens) + "; the rig has " + std::to_string(in.rig.lenses.size()));
  const auto l = static_cast<std::size_t>(lens);
  const PosedLens& through = in.rig.at(lens);
  if (picture.width != through.width || picture.height != through.height)
    return wrong("the picture has " + std::to_string(picture.width) + "x" + std::to_string(picture.height) +
                 " pixels, the calibration is for " + std::to_string(through.width) + "x" +
                 std::to_string(through.height));

  BodyObservation out;
  out.min_contrast = contrast_above_noise(picture);
  const std::optional<BodyPrediction> expected = in.motion.predict(mid_exposure);
  const std::optional<BodyView> view =
      expected && in.seen[l] ? view_of(through, in.tags, expected->probe_body) : std::nullopt;
  out.predicted = view.has_value();
  const auto search = [&](PixelRegion region, double decimate, Tones tones) -> Result<BodyPose> {
    out.region = region;
    out.decimate = decimate;
    in.tones = tones;
    Result<std::vector<TagDetection>> tags =
        in.detector.detect_in(picture, {region, decimate, out.min_contrast, tones});
    if (!tags) return tags.status();
    out.tags = std::move(*tags);
    std::vector<TagObservation> seen;
    for (const TagDetection& tag : out.tags) seen.push_back({lens, tag});
    return find_body_pose(in.rig, in.body, seen, expected, in.options.pose);
  };
  const PixelRegion whole{0, 0, picture.width, picture.height};
  Result<BodyPose> pose =
      view ? search(view->region, in.options.decimate > 0 ? in.options.decimate : decimation_for(view->cell_px),
                    in.tones)
           : search(whole, in.options.search_decimate, Tones::unchanged);
  if (!view && !pose && in.options.search_decimate == 1 && search_thoroughly(in.misses)) {
    pose = search(whole, kEnlarged, Tones::unchanged);
    if (!pose) pose = search(whole, 1, Tones::logarithmic);
  }
  // The smallest tags of a body that has just been found.
  if (!view && pose && out.decimate == 1)
    if (const auto found = view_of(through, in.tags, pose->probe_body); found && decimation_for(found->cell_px) < 1) {
      BodyObservation before = out;
      if (Result<BodyPose> better = search(found->region, kEnlarged, in.tones))
        pose = std::move(better);
      else
        out = std::move(before);
    }
  in.seen[l] = pose.ok();
  if (pose) {
    in.misses = 0;
    in.motion.update(mid_exposure, without_common_errors(*pose, in.options.pose.focal_sigma), !pose->ambiguous);
    out.pose = std::move(*pose);
  } else {
    out.failure_reason = pose.status().message();
    if (++in.misses >= in.options.lost_after) in.motion.reset();
  }
  return out;
}

}  // namespace lightwell
