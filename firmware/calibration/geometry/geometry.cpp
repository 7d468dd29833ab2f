#include "calibration/geometry/geometry.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <optional>
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
/// Of double sphere and Mei the focal length goes with xi; where it is known to less than this, so is every number.
constexpr double kVagueWithXi = 0.2;
/// A board's shape is fitted from here on: mean of its numbers' squares in deviations (Wald), and one number alone.
constexpr double kShapeEvidence = 4, kSpacingDeviations = 5;
/// A picture whose tags are spaced so differently, in shares and in deviations, shows another board.
constexpr double kOtherSpacing = 0.01, kOtherDeviations = 6;
/// A picture that loses this share of its points, and so many, is named.
constexpr double kManyOutliers = 0.2;
constexpr std::size_t kSomeOutliers = 8;
/// A surface that is bent by less is flat as far as anyone can glue.
constexpr double kLeastFlatness_m = 2e-4;
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

const char* name_of(LensKind kind) {
  return kind == LensKind::mei ? "mei" : kind == LensKind::double_sphere ? "double-sphere" : "kannala-brandt";
}

/// Whether every number of the lens is known well enough to be one.
bool is_determined(const BundleFit& fit, LensKind kind) {
  for (std::size_t k = 0; k < fit.state.lenses.size(); ++k) {
    const double focal = numbers_of(fit.state.lenses[k])[0], variance = fit.lens_covariance[k][0];
    const double most = kind == LensKind::kannala_brandt ? kVagueFocal : kVagueWithXi;
    if (!std::isfinite(variance) || !(std::sqrt(variance) <= most * std::abs(focal))) return false;
  }
  return true;
}

/// Whether the residuals contradict a board's points.
bool has_shape(const BundleFit& fit, std::size_t board) {
  if (fit.shape_covariance.empty() || fit.shape_covariance[board].empty()) return false;
  constexpr auto kSize = static_cast<Eigen::Index>(BoardShape::kParameters);
  const Eigen::Map<const Eigen::Matrix<double, kSize, kSize, Eigen::RowMajor>> c(fit.shape_covariance[board].data());
  const Eigen::Map<const Eigen::Vector<double, kSize>> d(fit.shapes[board].numbers.data());
  if (d[0] * d[0] > kSpacingDeviations * kSpacingDeviations * c(0, 0)) return true;
  const double evidence = d.dot(c.completeOrthogonalDecomposition().solve(d)) / static_cast<double>(kSize);
  return evidence > kShapeEvidence;
}

/// Pictures of captures whose tags are spaced unlike those of most; none where that is not the exception.
std::vector<bool> other_boards(const BundleFit& fit, const Sightings& s) {
  std::vector<double> spacings;
  for (const Estimate& e : fit.capture_spacing)
    if (e.sigma > 0) spacings.push_back(e.value);
  std::vector<bool> out(s.pictures.size());
  if (spacings.empty()) return out;
  const auto middle = spacings.begin() + static_cast<std::ptrdiff_t>(spacings.size() / 2);
  std::nth_element(spacings.begin(), middle, spacings.end());
  for (std::size_t i = 0; i < s.pictures.size(); ++i) {
    const Estimate& e = fit.capture_spacing[static_cast<std::size_t>(s.pictures[i].capture)];
    const double off = std::abs(e.value - *middle);
    out[i] = e.sigma > 0 && off > kOtherSpacing && off > kOtherDeviations * e.sigma && !s.pictures[i].sightings.empty();
  }
  if (3 * std::count(out.begin(), out.end(), true) > static_cast<std::ptrdiff_t>(s.pictures.size()))
    out.assign(out.size(), false);
  return out;
}

/// Leaves out what the first fit shows to be no sighting of its point. Returns how many.
std::size_t drop_outliers(const BundleFit& fit, Sightings& s) {
  const double limit = kOutlier * std::max(fit.spread_px, 0.05);
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

BoardFit board_fit(const BundleFit& fit, const Board& board, std::size_t at) {
  BoardFit out;
  out.shape = fit.shapes[at];
  if (!fit.shape_covariance.empty() && !fit.shape_covariance[at].empty())
    out.spacing_sigma = std::sqrt(fit.shape_covariance[at][0]);
  out.flatness_m = flatness(board, out.shape);
  return out;
}

std::string rounded(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::vector<std::string> shape_notes(const BoardFit& board, const Board& of) {
  std::vector<std::string> out;
  if (std::abs(board.shape.spacing_change()) > kSpacingDeviations * board.spacing_sigma && board.spacing_sigma > 0)
    out.push_back("board '" + of.name + "': its tags are " + rounded(100 * board.shape.spacing_change(), 2) + " +- " +
                  rounded(100 * board.spacing_sigma, 2) +
                  " % further apart than it says, and were taken so; measure the spacing and the size of its tags");
  if (board.flatness_m > kLeastFlatness_m)
    out.push_back("board '" + of.name + "' is not flat: its points span " + rounded(1e3 * board.flatness_m, 2) +
                  " mm across the best plane; its shape was fitted and used, but glue it to something flat");
  return out;
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
  out.pictures.resize(given.pictures.size());
  const std::vector<bool> other = other_boards(*first, sightings);
  for (std::size_t i = 0; i < other.size(); ++i) {
    if (!other[i]) continue;
    sightings.pictures[i].sightings.clear();
    out.pictures[i].other_board = true;
    out.notes.push_back(given.pictures[i].name +
                        " was left out: its tags are spaced unlike those of the other pictures, so it shows another "
                        "board with the same numbers");
  }
  if (std::find(other.begin(), other.end(), true) != other.end()) {
    first = fit_bundle(sightings, first->state, bundle);
    if (!first) return first.status();
  }
  const Sightings of_board = sightings;
  // What hid behind the worst shows after them.
  const auto settle = [&](const BundleState& start) -> Result<BundleFit> {
    Result<BundleFit> fit = fit_bundle(sightings, start, bundle);
    for (int round = 0; fit && round < kOutlierRounds; ++round) {
      if (drop_outliers(*fit, sightings) == 0) break;
      bundle.robust_px = std::max(0.05, 3 * fit->spread_px);
      fit = fit_bundle(sightings, fit->state, bundle);
    }
    return fit;
  };
  (void)drop_outliers(*first, sightings);
  const auto as = [&](LensKind kind) {
    BundleState start = first->state;
    for (std::size_t k = 0; k < start.lenses.size(); ++k)
      start.lenses[k] = as_kind(std::get<KannalaBrandtParameters>(start.lenses[k]), kind, seen_by(k, start.lenses[k]));
    return start;
  };
  bundle.robust_px = std::max(0.05, 3 * first->spread_px);
  Result<BundleFit> fit = settle(as(options.kind));
  if (!fit || !is_determined(*fit, options.kind)) {
    // Of the models that they do determine, the one that leaves the least.
    std::optional<LensKind> better;
    double least = std::numeric_limits<double>::infinity();
    for (const LensKind kind : {LensKind::kannala_brandt, LensKind::mei, LensKind::double_sphere}) {
      if (kind == options.kind) continue;
      const Result<BundleFit> another = fit_bundle(sightings, as(kind), bundle);
      if (!another || !is_determined(*another, kind) || !(another->sigma_px < least)) continue;
      least = another->sigma_px;
      better = kind;
    }
    if (better)
      return tells_too_little("the pictures do not determine the numbers of the model " +
                              std::string(name_of(options.kind)) + "; they determine " + name_of(*better) +
                              " (--model " + name_of(*better) + ")");
    if (!fit) return fit.status();
    return tells_too_little("the focal length is not known to " + std::to_string(static_cast<int>(100 * kVagueFocal)) +
                            " %; take more pictures, with the board tilted and in all parts of the picture");
  }
  std::vector<bool> shaped(given.boards.size());
  for (std::size_t b = 0; b < shaped.size(); ++b) shaped[b] = has_shape(*fit, b);
  if (std::find(shaped.begin(), shaped.end(), true) != shaped.end()) {
    // What a plane left out may be right.
    bundle.shapes = true;
    sightings = of_board;
    BundleState start = fit->state;
    start.shapes.clear();
    fit = settle(start);
    if (!fit) return fit.status();
  }
  std::size_t dropped = 0;
  for (std::size_t i = 0; i < given.pictures.size(); ++i) {
    PictureFit& p = out.pictures[i];
    p.points = given.pictures[i].sightings.size();
    p.outliers = p.other_board ? 0 : p.points - sightings.pictures[i].sightings.size();
    dropped += p.outliers;
    if (p.outliers >= kSomeOutliers && static_cast<double>(p.outliers) > kManyOutliers * static_cast<double>(p.points))
      out.notes.push_back(given.pictures[i].name + ": " + std::to_string(p.outliers) + " of " +
                          std::to_string(p.points) + " points were left out; look at the picture, or take it away");
  }
  if (dropped > 0)
    out.notes.push_back(std::to_string(dropped) + " points were left out: they lie more than " +
                        std::to_string(static_cast<int>(kOutlier)) + " deviations from where they belong");
  for (std::size_t b = 0; b < given.boards.size(); ++b) {
    BoardFit board;
    if (bundle.shapes) board = board_fit(*fit, given.boards[b], b);
    for (const std::string& note : shape_notes(board, given.boards[b])) out.notes.push_back(note);
    out.boards.push_back(board);
  }

  for (std::size_t k = 0; k < fit->state.lenses.size(); ++k) {
    LensFit lens;
    lens.model = fit->state.lenses[k];
    lens.covariance = fit->lens_covariance[k];
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
