#include "calibration/geometry/geometry.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include <Eigen/Dense>

#include "calibration/geometry/initial.hpp"
#include "calibration/projection.hpp"

namespace lightwell::calibration {
namespace {

using std::numbers::pi;

/// Zhang 2000 needs three poses of a plane; with fewer than these the covariance is too wide to be of use.
constexpr std::size_t kLeastPictures = 5, kLeastSightings = 100;
/// Boards whose normals differ by less face the lens all alike, and size cannot be told from distance.
constexpr double kLeastTilt_rad = 10 * pi / 180;
/// A focal length that is not known to this is none.
constexpr double kVagueFocal = 0.02;
/// What lies so many deviations away after the first fit is no sighting of the point that it says.
constexpr double kOutlier = 6;
constexpr std::size_t kLeastOfPicture = 4;
constexpr int kOutlierRounds = 3;

Status bad(const std::string& what) { return {StatusCode::invalid_argument, "calibration: " + what}; }
Status tells_too_little(const std::string& what) { return {StatusCode::failed_precondition, "calibration: " + what}; }

Status check(const Sightings& s) {
  if (s.lenses.empty() || s.lenses.size() > 2) return bad("a rig has one or two lenses");
  if (s.boards.empty()) return bad("there is no board");
  for (const LensSize& l : s.lenses)
    if (l.width < 2 || l.height < 2)
      return bad("pictures of " + std::to_string(l.width) + "x" + std::to_string(l.height) + " pixels");
  for (const Board& b : s.boards)
    for (const Vec3d& p : b.points)
      if (!std::isfinite(p.x + p.y) || p.z != 0)
        return bad("board '" + b.name + "' is not flat, or a point of it is no number");
  for (const Picture& p : s.pictures) {
    if (p.lens < 0 || static_cast<std::size_t>(p.lens) >= s.lenses.size())
      return bad(p.name + " is of lens " + std::to_string(p.lens) + ", which is not there");
    if (p.capture < 0) return bad(p.name + " has no capture");
    for (const Sighting& k : p.sightings) {
      if (k.board < 0 || static_cast<std::size_t>(k.board) >= s.boards.size() || k.point < 0 ||
          static_cast<std::size_t>(k.point) >= s.boards[static_cast<std::size_t>(k.board)].points.size())
        return bad(p.name + " shows a point that no board has");
      if (!std::isfinite(k.pixel.x) || !std::isfinite(k.pixel.y))
        return bad(p.name + " shows a point at a pixel that is no number");
      const LensSize& size = s.lenses[static_cast<std::size_t>(p.lens)];
      if (k.pixel.x < -0.5 || k.pixel.y < -0.5 || k.pixel.x > size.width - 0.5 || k.pixel.y > size.height - 0.5)
        return bad(p.name + " shows a point outside its " + std::to_string(size.width) + "x" +
                   std::to_string(size.height) + " pixels");
    }
  }
  return {};
}

/// Before anything is fitted: whether there is enough of it.
Status check_enough(const Sightings& s, int lens) {
  std::size_t pictures = 0, sightings = 0, most_points = 0;
  for (const Picture& p : s.pictures) {
    if (p.lens != lens || p.sightings.empty()) continue;
    ++pictures;
    sightings += p.sightings.size();
    most_points = std::max(most_points, p.sightings.size());
  }
  const std::string who = s.lenses.size() > 1 ? "lens " + std::to_string(lens) + ": " : "";
  if (pictures < kLeastPictures)
    return tells_too_little(who + std::to_string(pictures) + " pictures show a board; take at least " +
                            std::to_string(kLeastPictures) + ", 20 to 40 are better");
  if (most_points <= 4)
    return tells_too_little(
        who +
        "one tag alone is seen in every picture, which does not tell a lens from a pose; use a board of "
        "several tags (lightwell-calibrate board)");
  if (sightings < kLeastSightings)
    return tells_too_little(who + std::to_string(sightings) +
                            " points are seen in all; take more pictures, nearer to the board");
  return {};
}

double angle_from_axis(Vec3d d) { return std::atan2(std::hypot(d.x, d.y), d.z); }

LensParameters lens_of(const LensSize& size, const ModelParameters& model) {
  LensParameters lens;
  lens.width = size.width;
  lens.height = size.height;
  lens.model = model;
  lens.max_angle_rad = pi;
  return lens;
}

ModelParameters as_kind(const KannalaBrandtParameters& k, LensKind kind, double largest_rad) {
  switch (kind) {
    case LensKind::kannala_brandt:
      return k;
    case LensKind::double_sphere:
      return alike<DoubleSphereModel>(k, largest_rad);
    case LensKind::mei:
      return alike<MeiModel>(k, largest_rad);
  }
  return k;
}

/// The numbers' covariance carried to directions, by small steps of each along the covariance's axes.
double direction_uncertainty(const LensSize& size, const ModelParameters& model, const std::vector<double>& covariance,
                             double seen_rad) {
  const std::vector<double> at = numbers_of(model);
  const auto n = static_cast<Eigen::Index>(at.size());
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> c(covariance.data(), n,
                                                                                                   n);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(c);
  const CameraModel camera(lens_of(size, model));
  double sum = 0;
  int count = 0;
  for (Eigen::Index k = 0; k < n; ++k) {
    const double deviation = std::sqrt(std::max(0.0, axes.eigenvalues()(k)));
    std::vector<double> other = at;
    for (Eigen::Index i = 0; i < n; ++i) other[static_cast<std::size_t>(i)] += deviation * axes.eigenvectors()(i, k);
    const CameraModel moved(lens_of(size, with_numbers(model, other.data())));
    count = 0;
    for (int i = 1; i <= 12; ++i) {
      for (int j = 0; j < 8; ++j) {
        const double theta = seen_rad * i / 12, phi = 2 * pi * j / 8;
        const auto pixel =
            camera.project({std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)});
        if (!pixel) continue;
        const auto a = camera.unproject(*pixel), b = moved.unproject(*pixel);
        if (!a || !b) continue;
        const double angle = angle_between(*a, *b);
        sum += angle * angle;
        ++count;
      }
    }
  }
  return count > 0 ? 3 * std::sqrt(sum / count) : std::numeric_limits<double>::infinity();
}

/// Leaves out what the first fit shows to be no sighting of its point. Returns how many.
std::size_t drop_outliers(const BundleFit& fit, Sightings& s) {
  const double limit = kOutlier * std::max(fit.sigma_px, 0.05);
  std::vector<std::set<int>> out(s.pictures.size());
  std::size_t count = 0;
  for (const Residual& r : fit.residuals) {
    if (std::hypot(r.x_px, r.y_px) <= limit) continue;
    out[static_cast<std::size_t>(r.picture)].insert(r.sighting);
    ++count;
  }
  for (std::size_t i = 0; i < s.pictures.size(); ++i) {
    std::vector<Sighting> kept;
    for (std::size_t k = 0; k < s.pictures[i].sightings.size(); ++k)
      if (!out[i].contains(static_cast<int>(k))) kept.push_back(s.pictures[i].sightings[k]);
    // What is left of a picture must still tell where the board was.
    if (kept.size() < kLeastOfPicture && kept.size() < s.pictures[i].sightings.size()) kept.clear();
    s.pictures[i].sightings = std::move(kept);
  }
  return count;
}

}  // namespace

Result<GeometryFit> calibrate_geometry(const Sightings& given, const GeometryOptions& options) {
  if (const Status s = check(given); !s.ok()) return s;
  std::vector<LensStart> starts;
  for (int lens = 0; lens < static_cast<int>(given.lenses.size()); ++lens) {
    if (const Status s = check_enough(given, lens); !s.ok()) return s;
    Result<LensStart> start = start_of_lens(given, lens);
    if (!start) return start.status();
    if (start->tilt_rad < kLeastTilt_rad)
      return tells_too_little(
          "all boards face the lens alike (their tilts differ by " + std::to_string(start->tilt_rad * 180 / pi) +
          " degrees), so that size cannot be told from distance; tilt the board by 30 degrees and more");
    starts.push_back(std::move(*start));
  }
  Result<BundleState> state = join(given, starts);
  if (!state) return state.status();

  GeometryFit out;
  Sightings sightings = given;
  const auto seen_by = [&](std::size_t lens, const ModelParameters& model) {
    const CameraModel camera(lens_of(sightings.lenses[lens], model));
    double seen = 0;
    for (const Picture& p : sightings.pictures)
      if (static_cast<std::size_t>(p.lens) == lens)
        for (const Sighting& s : p.sightings)
          if (const auto d = camera.unproject(s.pixel)) seen = std::max(seen, angle_from_axis(*d));
    return seen;
  };
  BundleOptions bundle;
  bundle.time_offset = options.time_offset;
  Result<BundleFit> first = fit_bundle(sightings, *state, bundle);
  if (!first) return first.status();
  std::size_t dropped = drop_outliers(*first, sightings);
  BundleState start = first->state;
  for (std::size_t k = 0; k < start.lenses.size(); ++k)
    start.lenses[k] =
        as_kind(std::get<KannalaBrandtParameters>(start.lenses[k]), options.kind, seen_by(k, start.lenses[k]));
  bundle.robust_px = std::max(0.05, 3 * first->sigma_px);
  Result<BundleFit> fit = fit_bundle(sightings, start, bundle);
  // What hid behind the worst shows after them.
  for (int round = 0; fit && round < kOutlierRounds; ++round) {
    const std::size_t more = drop_outliers(*fit, sightings);
    if (more == 0) break;
    dropped += more;
    bundle.robust_px = std::max(0.05, 3 * fit->sigma_px);
    fit = fit_bundle(sightings, fit->state, bundle);
  }
  if (!fit) return fit.status();
  if (dropped > 0)
    out.notes.push_back(std::to_string(dropped) + " points were left out: they lie more than " +
                        std::to_string(static_cast<int>(kOutlier)) + " deviations from where they belong");

  for (std::size_t k = 0; k < fit->state.lenses.size(); ++k) {
    LensFit lens;
    lens.model = fit->state.lenses[k];
    lens.covariance = fit->lens_covariance[k];
    const std::vector<double> values = numbers_of(lens.model);
    // Of a sphere behind the plane the focal length goes with xi, and only their ratio is known well.
    if (!std::isfinite(lens.covariance[0]) ||
        (options.kind == LensKind::kannala_brandt && std::sqrt(lens.covariance[0]) > kVagueFocal * values[0]))
      return tells_too_little("the focal length is not known to " +
                              std::to_string(static_cast<int>(100 * kVagueFocal)) +
                              " %; take more pictures, with the board tilted and in all parts of the picture");
    lens.seen_rad = seen_by(k, lens.model);
    lens.largest_rad = CameraModel(lens_of(sightings.lenses[k], lens.model)).max_angle_rad();
    lens.direction_uncertainty_rad =
        direction_uncertainty(sightings.lenses[k], lens.model, lens.covariance, lens.seen_rad);
    out.lenses.push_back(std::move(lens));
  }
  if (fit->state.lenses.size() > 1) {
    out.pair = fit->state.lens_from_rig[1];
    out.pair_covariance = fit->pair_covariance;
    out.time_offset_s = fit->state.time_offset_s;
    out.time_offset_sigma_s = fit->time_offset_sigma_s;
  }
  out.bundle = std::move(*fit);
  out.used = std::move(sightings);
  return out;
}

}  // namespace lightwell::calibration
