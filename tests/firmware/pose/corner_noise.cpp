#include "firmware/pose/corner_noise.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "calibration/model/response.hpp"

namespace lightwell::test {

namespace {

using Eigen::Vector2d;

/// Quantile of chi² with three degrees of freedom, of the probability within 3 sigma of one.
constexpr double kThreeSigma3 = 14.16;
constexpr double kFocal_px = 550;

/// Pixels of a side of a picture that contains a body up to 0.1 of its distance off the axis; a multiple of 8.
int side_for(double width_px) { return 8 * static_cast<int>((width_px + 0.2 * kFocal_px + 24) / 8); }

Vector2d vector(PixelPosition p) { return {p.x, p.y}; }

Eigen::Matrix2d matrix(const PixelCovariance& c) {
  Eigen::Matrix2d out;
  out << c.xx, c.xy, c.xy, c.yy;
  return out;
}

void add_corners(const TagDetection& found, const TagDetection& truth, CornerStatistics& out) {
  ++out.tags;
  out.refined += found.refined;
  const int cells = shape_of(found.family).edge_cells;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d corner = vector(truth.corners[k]), error = vector(found.corners[k]) - corner;
    const Eigen::Matrix2d covariance = matrix(found.covariance[k]);
    out.squares_px2 += error.squaredNorm();
    out.normalized += error.dot(covariance.inverse() * error);
    for (const std::size_t step : {1u, 3u}) {
      const Vector2d along = vector(truth.corners[(k + step) % 4]) - corner,
                     inward = vector(truth.corners[(k + 4 - step) % 4]) - corner;
      Vector2d normal = Vector2d(-along.y(), along.x()).normalized();
      if (normal.dot(inward) > 0) normal = -normal;
      out.ends.push_back(
          {-normal.dot(inward) / cells, along.norm(), normal.dot(error), std::sqrt(normal.dot(covariance * normal))});
    }
  }
}

void add_pose(const BodyPose& found, const Pose& truth, CornerStatistics& out) {
  const double freedom = 8.0 * found.used - 6;
  ++out.poses;
  out.cost += found.chi_square * freedom;
  out.freedom += freedom;
  out.ambiguous += found.ambiguous;
  AttitudeCounts& counts = out.by_tags[static_cast<std::size_t>(std::min(found.used, 3) - 1)];
  ++counts.poses;
  counts.ambiguous += found.ambiguous;
  if (found.ambiguous) return;
  ++out.confident;
  const auto e = error_of(found.probe_body.pose, truth);
  Eigen::Matrix<double, 6, 6> c;
  Eigen::Matrix<double, 6, 1> v;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    v[row] = e[i];
    for (std::size_t k = 0; k < 6; ++k) c(row, static_cast<Eigen::Index>(k)) = found.probe_body.covariance[i][k];
  }
  out.pose_normalized += v.dot(c.ldlt().solve(v));
  const Eigen::Vector3d turn = v.head<3>();
  if (turn.dot(c.topLeftCorner<3, 3>().ldlt().solve(turn)) > kThreeSigma3) {
    ++counts.beyond_3_sigma;
    counts.mistaken += turn.norm() > 5 * kDegree;
  }
}

}  // namespace

AttitudeCounts& AttitudeCounts::operator+=(const AttitudeCounts& other) {
  poses += other.poses;
  ambiguous += other.ambiguous;
  beyond_3_sigma += other.beyond_3_sigma;
  mistaken += other.mistaken;
  return *this;
}

AttitudeCounts CornerStatistics::all_tags() const {
  AttitudeCounts out;
  for (const AttitudeCounts& counts : by_tags) out += counts;
  return out;
}

BodyPoseOptions exact_camera() {
  BodyPoseOptions options;
  options.model_error_px = options.focal_sigma = 0;
  options.face_turn_sigma_rad = options.face_shift_sigma_m = 0;
  return options;
}

void compress_blocks(reference::GreyBytes& picture, int quality) {
  // ITU-T T.81 (1992), table K.1.
  constexpr std::array<int, 64> kLuminance = {16, 11, 10, 16, 24,  40,  51,  61,  12, 12, 14, 19, 26,  58,  60,  55,  //
                                              14, 13, 16, 24, 40,  57,  69,  56,  14, 17, 22, 29, 51,  87,  80,  62,  //
                                              18, 22, 37, 56, 68,  109, 103, 77,  24, 35, 55, 64, 81,  104, 113, 92,  //
                                              49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99};
  using Block = Eigen::Matrix<double, 8, 8>;
  Block cosines, steps;
  const int scale = quality < 50 ? 5000 / quality : 200 - 2 * quality;
  for (int k = 0; k < 8; ++k)
    for (int i = 0; i < 8; ++i) {
      cosines(k, i) = (k == 0 ? std::sqrt(1.0 / 8) : 0.5) * std::cos((2 * i + 1) * k * kPi / 16);
      steps(k, i) = std::clamp((kLuminance[static_cast<std::size_t>(8 * k + i)] * scale + 50) / 100, 1, 255);
    }
  for (int top = 0; top + 8 <= picture.height; top += 8)
    for (int left = 0; left + 8 <= picture.width; left += 8) {
      const auto at = [&](int y, int x) -> std::uint8_t& {
        return picture.pixels[static_cast<std::size_t>((top + y) * picture.width + left + x)];
      };
      Block block;
      for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) block(y, x) = at(y, x) - 128.0;
      Block sent = cosines * block * cosines.transpose();
      sent = (sent.array() / steps.array()).round() * steps.array();
      block = cosines.transpose() * sent * cosines;
      for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x)
          at(y, x) = static_cast<std::uint8_t>(std::clamp(std::round(block(y, x) + 128), 0.0, 255.0));
    }
}

CornerScenes::CornerScenes(const MarkerBody& body, double width_px, int attitudes, std::uint64_t first_seed,
                           const BuildErrors& errors)
    : rig_(camera_rig(side_for(width_px), side_for(width_px), kFocal_px)),
      body_(body),
      camera_(rig_, body, first_seed) {
  const double distance = distance_for(width_px, kFocal_px);
  for (int i = 0; i < attitudes; ++i) {
    BodyShot shot;
    shot.seed = first_seed + static_cast<std::uint64_t>(i);
    // Off the axis by up to a tenth of the distance, at a different subpixel position each.
    const double a = 2.4 * i;
    shot.probe_body = body_at({0.1 * distance * std::cos(a), 0.1 * distance * std::sin(a), -distance}, shot.seed);
    const MarkerBody built = with_build_errors(body, errors, shot.seed);
    scenes_.push_back({shot, BodyCamera(rig_, built, first_seed).radiance(shot),
                       simulate_observations(rig_, *tags_of(built), inverse(shot.probe_body), 0, 1)});
  }
}

CornerStatistics CornerScenes::measure(CornerRefinement refinement, const CornerCell& cell,
                                       const BodyPoseOptions& options) const {
  CornerStatistics out;
  TagDetectorOptions detect;
  detect.corners = refinement;
  if (cell.srgb) {
    PhotometricCalibration photometry;
    photometry.response.kind = ResponseCurve::Kind::srgb;
    detect.linear = linear_table(photometry, 256);
  }
  TagDetector detector = std::move(*TagDetector::make(detect));
  const PosedLenses lenses(rig_);
  for (const Scene& scene : scenes_) {
    BodyShot shot = scene.shot;
    shot.blur_px = cell.blur_px;
    shot.electrons = cell.electrons;
    shot.exposure = cell.exposure;
    shot.srgb = cell.srgb;
    reference::GreyBytes picture = camera_.expose(scene.radiance, shot);
    if (cell.jpeg_quality > 0) compress_blocks(picture, cell.jpeg_quality);
    const DetectionWindow whole{
        {0, 0, picture.width, picture.height}, cell.decimate, contrast_above_noise(picture.view())};
    std::vector<TagObservation> seen;
    const auto tags = detector.detect_in(picture.view(), whole);
    for (const TagDetection& tag : *tags) {
      const auto truth = std::ranges::find_if(scene.truth, [&](const TagObservation& t) { return t.tag.id == tag.id; });
      if (truth == scene.truth.end()) continue;
      seen.push_back({0, tag});
      add_corners(tag, truth->tag, out);
    }
    const auto pose = find_body_pose(lenses, body_, seen, std::nullopt, options);
    if (pose) add_pose(*pose, scene.shot.probe_body, out);
  }
  return out;
}

}  // namespace lightwell::test
