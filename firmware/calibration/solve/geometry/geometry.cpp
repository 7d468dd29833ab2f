#include "calibration/solve/geometry/geometry.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <set>

#include <Eigen/Dense>

#include <lightwell/quantile.hpp>
#include <lightwell/text.hpp>

#include "calibration/model/cameras.hpp"
#include "calibration/solve/geometry/initial.hpp"

namespace lightwell::calibration {
namespace {

using std::numbers::pi;

/// Zhang 2000 needs three poses of a plane; with fewer pictures or observations than these the covariance is too large.
constexpr std::size_t kMinPictures = 5, kMinObservations = 100;
/// Smallest angle between board normals: with parallel boards focal length and distance are not separable.
constexpr double kMinTilt_rad = 10 * pi / 180;
/// Largest relative standard deviation of the focal length.
constexpr double kMaxFocalSigma = 0.02;
/// The same for double sphere and Mei, whose focal length is correlated with xi.
constexpr double kMaxFocalSigmaWithXi = 0.2;
/// Evidence from which a board's shape is estimated: Wald statistic per parameter, and sigmas of the spacing alone.
constexpr double kShapeEvidence = 4, kSpacingSigmas = 5;
/// Difference of the tag spacing, relative and in standard deviations, from which a picture shows another board.
constexpr double kSpacingDifference = 0.01, kSpacingDifferenceSigmas = 6;
/// Fraction (and number) of outliers from which a picture is reported.
constexpr double kMaxOutlierFraction = 0.2;
constexpr std::size_t kMinReportedOutliers = 8;
/// Flatness deviation below which no note is made.
constexpr double kMinFlatness_m = 2e-4;
/// Residual after the first fit, in standard deviations, from which an observation is an outlier.
constexpr double kOutlierThreshold = 6;
constexpr std::size_t kMinPointsPerPicture = 4;
constexpr int kOutlierRounds = 3;

Status bad(const std::string& what) { return invalid_argument("calibration: " + what); }
Status is_underdetermined(const std::string& what) { return {StatusCode::failed_precondition, "calibration: " + what}; }

Status check(const BoardObservations& s) {
  if (s.lenses.empty() || s.lenses.size() > 2) return bad("a rig has one or two lenses");
  if (s.boards.empty()) return bad("there is no board");
  for (const LensSize& l : s.lenses)
    if (l.width < 2 || l.height < 2)
      return bad("pictures of " + std::to_string(l.width) + "x" + std::to_string(l.height) + " pixels");
  for (const Board& b : s.boards)
    for (const Vec3d& p : b.points)
      if (!std::isfinite(p.x + p.y) || p.z != 0)
        return bad("board '" + b.name + "' is not flat, or a point of it is no number");
  const auto is_index = [](int at, const auto& of) { return at >= 0 && static_cast<std::size_t>(at) < of.size(); };
  for (const Picture& p : s.pictures) {
    if (!is_index(p.lens, s.lenses))
      return bad(p.name + " is of lens " + std::to_string(p.lens) + ", which is not there");
    if (p.capture < 0) return bad(p.name + " has no capture");
    const LensSize& size = s.lenses[static_cast<std::size_t>(p.lens)];
    for (const PointObservation& k : p.observations) {
      if (!is_index(k.board, s.boards) || !is_index(k.point, s.boards[static_cast<std::size_t>(k.board)].points))
        return bad(p.name + " shows a point that no board has");
      if (!std::isfinite(k.pixel.x) || !std::isfinite(k.pixel.y))
        return bad(p.name + " shows a point at a pixel that is no number");
      if (!(k.pixel.x >= -0.5 && k.pixel.y >= -0.5 && k.pixel.x <= size.width - 0.5 && k.pixel.y <= size.height - 0.5))
        return bad(p.name + formatted(" shows a point outside its %dx%d pixels", size.width, size.height));
    }
  }
  return {};
}

/// Checks before fitting that there are enough observations.
Status check_enough(const BoardObservations& s, int lens) {
  std::size_t pictures = 0, observations = 0, max_points = 0;
  for (const Picture& p : s.pictures) {
    if (p.lens != lens || p.observations.empty()) continue;
    ++pictures;
    observations += p.observations.size();
    max_points = std::max(max_points, p.observations.size());
  }
  const std::string who = s.lenses.size() > 1 ? "lens " + std::to_string(lens) + ": " : "";
  if (pictures < kMinPictures)
    return is_underdetermined(who + std::to_string(pictures) + " pictures show a board; take at least " +
                              std::to_string(kMinPictures) + ", 20 to 40 are better");
  if (max_points <= 4)
    return is_underdetermined(
        who +
        "every picture shows only one tag, which does not determine both lens and pose; use a board of "
        "several tags (lightwell-calibrate board)");
  if (observations < kMinObservations)
    return is_underdetermined(who + std::to_string(observations) +
                              " points are seen in all; take more pictures, nearer to the board");
  return {};
}

double angle_from_axis(Vec3d d) { return std::atan2(std::hypot(d.x, d.y), d.z); }

/// Propagates the covariance of the parameters to directions, by finite differences along its principal axes.
double direction_uncertainty(const LensSize& size, const ModelParameters& model, const std::vector<double>& covariance,
                             double max_observed_angle_rad) {
  const std::vector<double> at = parameters_of(model);
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
    const CameraModel moved(lens_of(size, with_parameters(model, other.data())));
    count = 0;
    for (int i = 1; i <= 12; ++i) {
      for (int j = 0; j < 8; ++j) {
        const double theta = max_observed_angle_rad * i / 12, phi = 2 * pi * j / 8;
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

const char* name_of(LensKind kind) {
  return kind == LensKind::mei ? "mei" : kind == LensKind::double_sphere ? "double-sphere" : "kannala-brandt";
}

/// Whether the observations determine all parameters of the lens with sufficient precision.
bool is_determined(const BundleFit& fit, LensKind kind) {
  for (std::size_t k = 0; k < fit.state.lenses.size(); ++k) {
    const double focal = parameters_of(fit.state.lenses[k])[0], variance = fit.lens_covariance[k][0];
    const double most = kind == LensKind::kannala_brandt ? kMaxFocalSigma : kMaxFocalSigmaWithXi;
    if (!std::isfinite(variance) || !(std::sqrt(variance) <= most * std::abs(focal))) return false;
  }
  return true;
}

/// Whether the residuals contradict a board's description.
bool has_shape(const BundleFit& fit, std::size_t board) {
  if (fit.shape_covariance.empty() || fit.shape_covariance[board].empty()) return false;
  constexpr auto kSize = static_cast<Eigen::Index>(BoardShape::kParameters);
  const Eigen::Map<const Eigen::Matrix<double, kSize, kSize, Eigen::RowMajor>> c(fit.shape_covariance[board].data());
  const Eigen::Map<const Eigen::Vector<double, kSize>> d(fit.shapes[board].numbers.data());
  if (d[0] * d[0] > kSpacingSigmas * kSpacingSigmas * c(0, 0)) return true;
  const double evidence = d.dot(c.completeOrthogonalDecomposition().solve(d)) / static_cast<double>(kSize);
  return evidence > kShapeEvidence;
}

/// Pictures of captures whose tag spacing differs from that of most captures; none if these are many.
std::vector<bool> other_boards(const BundleFit& fit, const BoardObservations& s) {
  std::vector<double> spacings;
  for (const Estimate& e : fit.capture_spacing)
    if (e.sigma > 0) spacings.push_back(e.value);
  std::vector<bool> out(s.pictures.size());
  if (spacings.empty()) return out;
  const double typical = upper_quantile(spacings, 0.5);
  for (std::size_t i = 0; i < s.pictures.size(); ++i) {
    const Estimate& e = fit.capture_spacing[static_cast<std::size_t>(s.pictures[i].capture)];
    const double off = std::abs(e.value - typical);
    out[i] = e.sigma > 0 && off > kSpacingDifference && off > kSpacingDifferenceSigmas * e.sigma &&
             !s.pictures[i].observations.empty();
  }
  if (3 * std::count(out.begin(), out.end(), true) > static_cast<std::ptrdiff_t>(s.pictures.size()))
    out.assign(out.size(), false);
  return out;
}

/// Removes the outliers of the first fit. Returns their number.
std::size_t drop_outliers(const BundleFit& fit, BoardObservations& s) {
  const double limit = kOutlierThreshold * std::max(fit.spread_px, 0.05);
  std::vector<std::set<int>> out(s.pictures.size());
  std::size_t count = 0;
  for (const Residual& r : fit.residuals) {
    if (std::hypot(r.x_px, r.y_px) <= limit) continue;
    out[static_cast<std::size_t>(r.picture)].insert(r.observation);
    ++count;
  }
  for (std::size_t i = 0; i < s.pictures.size(); ++i) {
    std::vector<PointObservation> kept;
    for (std::size_t k = 0; k < s.pictures[i].observations.size(); ++k)
      if (!out[i].contains(static_cast<int>(k))) kept.push_back(s.pictures[i].observations[k]);
    // The remaining points of a picture must determine the board's pose.
    if (kept.size() < kMinPointsPerPicture && kept.size() < s.pictures[i].observations.size()) kept.clear();
    s.pictures[i].observations = std::move(kept);
  }
  return count;
}

std::string rounded(double value, int digits) { return formatted("%.*f", digits, value); }

/// Messages for the user about a board whose spacing or flatness differs from its description.
std::vector<std::string> shape_notes(const BoardFit& fit, const Board& board) {
  std::vector<std::string> out;
  if (std::abs(fit.shape.spacing_change()) > kSpacingSigmas * fit.spacing_sigma && fit.spacing_sigma > 0)
    out.push_back("board '" + board.name + "': the distance between its tags differs from its description by " +
                  rounded(100 * fit.shape.spacing_change(), 2) + " +- " + rounded(100 * fit.spacing_sigma, 2) +
                  " %; the estimated distance was used; measure the spacing and the size of its tags");
  if (fit.flatness_m > kMinFlatness_m)
    out.push_back("board '" + board.name + "' is not flat: its points span " + rounded(1e3 * fit.flatness_m, 2) +
                  " mm perpendicular to the best-fit plane; its shape was estimated and used; glue the board to "
                  "something flat");
  return out;
}

}  // namespace

Result<GeometryFit> calibrate_geometry(const BoardObservations& given, const GeometryOptions& options) {
  if (const Status s = check(given); !s.ok()) return s;
  std::vector<LensInitialization> starts;
  for (int lens = 0; lens < static_cast<int>(given.lenses.size()); ++lens) {
    if (const Status s = check_enough(given, lens); !s.ok()) return s;
    Result<LensInitialization> start = initialize_lens(given, lens);
    if (!start) return start.status();
    if (start->tilt_rad < kMinTilt_rad)
      return is_underdetermined(
          "all boards are parallel (their tilts differ by " + std::to_string(start->tilt_rad * 180 / pi) +
          " degrees), so that focal length and distance cannot be separated; tilt the board by 30 degrees and more");
    starts.push_back(std::move(*start));
  }
  Result<BundleState> state = initialize_bundle(given, starts);
  if (!state) return state.status();

  GeometryFit out;
  BoardObservations observations = given;
  const auto seen_by = [&](std::size_t lens, const ModelParameters& model) {
    const CameraModel camera(lens_of(observations.lenses[lens], model));
    double seen = 0;
    for (const Picture& p : observations.pictures)
      if (static_cast<std::size_t>(p.lens) == lens)
        for (const PointObservation& s : p.observations)
          if (const auto d = camera.unproject(s.pixel)) seen = std::max(seen, angle_from_axis(*d));
    return seen;
  };
  BundleOptions bundle;
  bundle.time_offset = options.time_offset;
  Result<BundleFit> first = fit_bundle(observations, *state, bundle);
  if (!first) return first.status();
  out.pictures.resize(given.pictures.size());
  const std::vector<bool> other = other_boards(*first, observations);
  for (std::size_t i = 0; i < other.size(); ++i) {
    if (!other[i]) continue;
    observations.pictures[i].observations.clear();
    out.pictures[i].other_board = true;
    out.notes.push_back(given.pictures[i].name +
                        " was rejected: its tag spacing differs from that of the other pictures, so it shows another "
                        "board with the same numbers");
  }
  if (std::find(other.begin(), other.end(), true) != other.end()) {
    first = fit_bundle(observations, first->state, bundle);
    if (!first) return first.status();
  }
  const BoardObservations of_board = observations;
  // Iterate, because large outliers mask smaller ones.
  const auto fit_and_reject = [&](const BundleState& start) -> Result<BundleFit> {
    Result<BundleFit> fit = fit_bundle(observations, start, bundle);
    for (int round = 0; fit && round < kOutlierRounds; ++round) {
      if (drop_outliers(*fit, observations) == 0) break;
      bundle.robust_px = std::max(0.05, 3 * fit->spread_px);
      fit = fit_bundle(observations, fit->state, bundle);
    }
    return fit;
  };
  (void)drop_outliers(*first, observations);
  const auto as = [&](LensKind kind) {
    BundleState start = first->state;
    for (std::size_t k = 0; k < start.lenses.size(); ++k)
      start.lenses[k] =
          equivalent_model(std::get<KannalaBrandtParameters>(start.lenses[k]), kind, seen_by(k, start.lenses[k]));
    return start;
  };
  bundle.robust_px = std::max(0.05, 3 * first->spread_px);
  Result<BundleFit> fit = fit_and_reject(as(options.kind));
  if (!fit || !is_determined(*fit, options.kind)) {
    // Suggest the model with the smallest residuals among those that are determined.
    std::optional<LensKind> better;
    double least = std::numeric_limits<double>::infinity();
    for (const LensKind kind : {LensKind::kannala_brandt, LensKind::mei, LensKind::double_sphere}) {
      if (kind == options.kind) continue;
      const Result<BundleFit> another = fit_bundle(observations, as(kind), bundle);
      if (!another || !is_determined(*another, kind) || !(another->sigma_px < least)) continue;
      least = another->sigma_px;
      better = kind;
    }
    if (better)
      return is_underdetermined("the pictures do not determine the numbers of the model " +
                                std::string(name_of(options.kind)) + "; they determine " + name_of(*better) +
                                " (--model " + name_of(*better) + ")");
    if (!fit) return fit.status();
    return is_underdetermined("the focal length is not determined to " +
                              std::to_string(static_cast<int>(100 * kMaxFocalSigma)) +
                              " %; take more pictures, with the board tilted and in all parts of the picture");
  }
  std::vector<bool> shaped(given.boards.size());
  for (std::size_t b = 0; b < shaped.size(); ++b) shaped[b] = has_shape(*fit, b);
  if (std::find(shaped.begin(), shaped.end(), true) != shaped.end()) {
    // Observations rejected under the assumption of a plane may fit with shapes.
    bundle.shapes = true;
    observations = of_board;
    BundleState start = fit->state;
    start.shapes.clear();
    fit = fit_and_reject(start);
    if (!fit) return fit.status();
  }
  std::size_t dropped = 0;
  for (std::size_t i = 0; i < given.pictures.size(); ++i) {
    PictureFit& p = out.pictures[i];
    p.points = given.pictures[i].observations.size();
    p.outliers = p.other_board ? 0 : p.points - observations.pictures[i].observations.size();
    dropped += p.outliers;
    if (p.outliers >= kMinReportedOutliers &&
        static_cast<double>(p.outliers) > kMaxOutlierFraction * static_cast<double>(p.points))
      out.notes.push_back(given.pictures[i].name + ": " + std::to_string(p.outliers) + " of " +
                          std::to_string(p.points) + " points were rejected; check the picture, or remove it");
  }
  if (dropped > 0)
    out.notes.push_back(std::to_string(dropped) + " points were rejected as outliers: they are more than " +
                        std::to_string(static_cast<int>(kOutlierThreshold)) +
                        " standard deviations from their predicted positions");
  for (std::size_t b = 0; b < given.boards.size(); ++b) {
    BoardFit board;
    if (bundle.shapes) {
      board.shape = fit->shapes[b];
      if (!fit->shape_covariance.empty() && !fit->shape_covariance[b].empty())
        board.spacing_sigma = std::sqrt(fit->shape_covariance[b][0]);
      board.flatness_m = flatness(given.boards[b], board.shape);
    }
    for (const std::string& note : shape_notes(board, given.boards[b])) out.notes.push_back(note);
    out.boards.push_back(board);
  }

  for (std::size_t k = 0; k < fit->state.lenses.size(); ++k) {
    LensFit lens;
    lens.model = fit->state.lenses[k];
    lens.covariance = fit->lens_covariance[k];
    lens.max_observed_angle_rad = seen_by(k, lens.model);
    lens.max_model_angle_rad = CameraModel(lens_of(observations.lenses[k], lens.model)).max_angle_rad();
    lens.direction_uncertainty_rad =
        direction_uncertainty(observations.lenses[k], lens.model, lens.covariance, lens.max_observed_angle_rad);
    out.lenses.push_back(std::move(lens));
  }
  out.bundle = std::move(*fit);
  out.used = std::move(observations);
  return out;
}

}  // namespace lightwell::calibration
