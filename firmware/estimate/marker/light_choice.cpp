#include "estimate/marker/light_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <span>

#include <Eigen/Eigenvalues>

#include "estimate/marker/light_fit.hpp"
#include "estimate/marker/light_search.hpp"
#include "estimate/marker/observations.hpp"
#include "estimate/marker/table_light.hpp"

namespace lightwell::marker {
namespace {

/// Of the samples, at most so many may be something else; more, and the model is what is wrong.
constexpr double kMostLeftOut = 0.35;
/// How wide a light could be, rad, and what chi square may grow by where it explains the faces as well.
constexpr std::array kRadii = {0.2, 0.4, 0.7, 1.0};
constexpr double kAsGood = 16;
/// How far off a direction may be where the model does not explain what was seen, rad.
constexpr double kUnexplained = 0.2;
/// Lamps are followed while chi square, over the degrees of freedom, is no more than so many times what it was, or what is good anyway.
constexpr double kFollowed = 1.5;
constexpr double kGoodEnough = 0.3;
/// From one frame to the next a fit is near its end when it begins.
constexpr int kFollowSteps = 6;
/// So many times are samples left out and the rest asked again.
constexpr int kRounds = 2;
/// The table is one plane of one colour where its samples differ from the model by no more than so many deviations, RMS,
constexpr double kTableFits = 0.35;
/// without leaving out more than a few of them,
constexpr double kTableKept = 0.8;
/// and it shows a shadow where that explains so much more than none (a difference of chi squares).
constexpr double kShadowShows = 30;
/// A lamp is one where it gives at least this share of what the brightest face gets: less is what surfaces send to each other.
constexpr double kFaintest = 0.06;
/// Where a lamp's distance is begun at least, 1/m: at infinity its derivative tells least.
constexpr double kFirstInverse = 0.5;
/// A sample that differs from its face's slope by more than this share of it, and by more than four times what the others do, is something else.
constexpr double kOffPlane = 0.03;

double luminance(const Rgb& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

struct Sought {
  Fit best;
  std::vector<Fit> others;
};

class Chooser {
 public:
  Chooser(const Observations& seen, const std::vector<Vec3d>& hull, const ChoiceOptions& options, Witness witness)
      : seen_(seen), hull_(hull), options_(options), witness_(witness) {}

  [[nodiscard]] Sought seek() {
    take(fit_lamps(seen_, {}, {}, witness_, hull_, options_.fit));
    if (options_.most_lamps >= 1 && worth_more()) {
      for (const LightSearch::Candidate& one : search().singles(3, witness_)) try_places(one.lamps);
      simplify(1);
    }
    if (options_.most_lamps >= 2 && worth_more()) {
      for (const LightSearch::Candidate& two : search().pairs(3)) try_places(two.lamps);
      if (best().model.lamps.size() == 1) try_beside(best().model.lamps);
      simplify(2);
    }
    for (std::size_t count = 3; count <= static_cast<std::size_t>(options_.most_lamps) && worth_more(); ++count) {
      if (best().model.lamps.size() + 1 != count) break;
      try_beside(best().model.lamps);
      simplify(count);
    }
    Sought out{best(), {}};
    for (std::size_t i = 0; i < fits_.size(); ++i)
      if (i != best_) out.others.push_back(fits_[i]);
    return out;
  }

  /// The lamps of the frame before, from where they were. Nothing where one of them is gone, or where they do not explain this frame.
  [[nodiscard]] std::optional<Sought> follow(const ChosenLight& before) {
    std::vector<Lamp> lamps;
    std::vector<Distance> distances;
    for (const ChosenLamp& lamp : before.lamps) {
      lamps.push_back(lamp.lamp);
      distances.push_back(lamp.free ? Distance::free : Distance::infinite);
    }
    FitOptions few = options_.fit;
    few.iterations = std::min(few.iterations, kFollowSteps);
    take(fit_lamps(seen_, std::move(lamps), std::move(distances), witness_, hull_, few));
    if (fits_.empty()) return std::nullopt;
    const double reduced = best().chi_square / std::max(1, best().observations - best().parameters);
    if (reduced > kFollowed * std::max(before.searched, kGoodEnough)) return std::nullopt;
    return Sought{best(), {}};
  }

  [[nodiscard]] LightSearch& search() {
    if (!search_) search_.emplace(seen_, hull_, options_.fit);
    return *search_;
  }

 private:
  [[nodiscard]] const Fit& best() const { return fits_[best_]; }

  /// Whether another lamp could pay for its parameters.
  [[nodiscard]] bool worth_more() const {
    const double price = (2 + seen_.channels()) * std::log(std::max(best().observations, 2));
    return best().chi_square > price;
  }

  void take(Fit fit) {
    for (const Lamp& lamp : fit.model.lamps)
      if (luminance(lamp.irradiance) < kFaintest * seen_.brightest(0)) return;
    fits_.push_back(std::move(fit));
    if (fits_.size() == 1 || fits_.back().bic() < best().bic()) best_ = fits_.size() - 1;
  }

  /// From these places, each lamp as near as it likes.
  void try_places(std::vector<Lamp> lamps) {
    for (Lamp& lamp : lamps) lamp.inverse_distance = std::max(lamp.inverse_distance, kFirstInverse);
    const std::vector<Distance> free(lamps.size(), Distance::free);
    take(fit_lamps(seen_, std::move(lamps), free, witness_, hull_, options_.fit));
  }

  /// The best fit of so many lamps again with all of them, and each one, infinitely far: what a distance does not pay for is distant.
  void simplify(std::size_t count) {
    const Fit* of_count = nullptr;
    for (const Fit& fit : fits_)
      if (fit.model.lamps.size() == count && (of_count == nullptr || fit.chi_square < of_count->chi_square)) of_count = &fit;
    if (of_count == nullptr) return;
    const std::vector<Lamp> lamps = of_count->model.lamps;
    const auto with = [&](std::vector<Distance> distances) {
      std::vector<Lamp> start = lamps;
      for (std::size_t k = 0; k < count; ++k)
        if (distances[k] == Distance::infinite) start[k].inverse_distance = 0;
      take(fit_lamps(seen_, start, distances, witness_, hull_, options_.fit));
    };
    with(std::vector<Distance>(count, Distance::infinite));
    if (count < 2) return;
    for (std::size_t k = 0; k < count; ++k) {
      std::vector<Distance> one(count, Distance::infinite);
      one[k] = Distance::free;
      with(one);
    }
  }

  void try_beside(std::vector<Lamp> lamps) {
    for (const LightSearch::Candidate& one : search().singles(2, witness_, lamps)) {
      std::vector<Lamp> more = lamps;
      more.push_back(one.lamps[0]);
      try_places(more);
    }
  }

  const Observations& seen_;
  const std::vector<Vec3d>& hull_;
  const ChoiceOptions& options_;
  Witness witness_;
  std::optional<LightSearch> search_;
  std::vector<Fit> fits_;
  std::size_t best_ = 0;
};

/// From unit vector `from` to `to` along the great circle, in tangent_basis(from), rad.
Eigen::Vector2d turn_of(Vec3d from, Vec3d to) {
  const auto [u, v] = tangent_basis(from);
  const double angle = angle_between(from, to), x = dot(to, u), y = dot(to, v), across = std::hypot(x, y);
  if (!(across > 0)) return {angle, 0};
  return {x / across * angle, y / across * angle};
}

std::size_t strongest(const LightModel& model) {
  std::size_t out = 0;
  for (std::size_t k = 1; k < model.lamps.size(); ++k)
    if (luminance(model.lamps[k].irradiance) > luminance(model.lamps[out].irradiance)) out = k;
  return out;
}

/// The covariance of one lamp's direction with all else in it that explains what was seen: other places on the sphere, other models.
Eigen::Matrix2d widened(const Sought& sought, std::size_t which, LightSearch& search, Witness witness) {
  const Fit& best = sought.best;
  const Vec3d direction = best.model.lamps[which].direction;
  const Eigen::Matrix2d own = best.covariance[which].topLeftCorner<2, 2>();

  std::vector<Lamp> beside = best.model.lamps;
  beside.erase(beside.begin() + static_cast<std::ptrdiff_t>(which));
  const LightSearch::Landscape map = search.landscape(witness, beside);
  // The landscape knows no bounds: measured from its own lowest place, if that is lower.
  double lowest = best.chi_square;
  for (const double chi : map.chi_square) lowest = std::min(lowest, chi);
  double mass = 2 * std::numbers::pi * std::sqrt(std::max(own.determinant(), 1e-18));
  Eigen::Matrix2d spread = mass * own;
  for (std::size_t i = 0; i < map.directions.size(); ++i) {
    const double weight = map.solid_angle * std::exp(-(map.chi_square[i] - lowest) / 2);
    if (weight < 1e-9) continue;
    const Eigen::Vector2d turn = turn_of(direction, map.directions[i]);
    spread += weight * turn * turn.transpose();
    mass += weight;
  }
  spread /= mass;

  double models = 1;
  Eigen::Matrix2d other = spread;
  for (const Fit& fit : sought.others) {
    if (fit.model.lamps.empty()) continue;
    const double weight = std::exp(-(fit.bic() - best.bic()) / 2);
    if (weight < 1e-6) continue;
    // The same lamp in the other model: the strongest of it for the strongest, else the nearest.
    std::size_t same = strongest(fit.model);
    if (which != strongest(best.model))
      for (std::size_t k = 0; k < fit.model.lamps.size(); ++k)
        if (angle_between(direction, fit.model.lamps[k].direction) < angle_between(direction, fit.model.lamps[same].direction)) same = k;
    const Eigen::Vector2d turn = turn_of(direction, fit.model.lamps[same].direction);
    other += weight * (spread + turn * turn.transpose());
    models += weight;
  }
  return other / models;
}

/// A diffuse surface hardly tells a wide light from a point in its middle: what shines strongest may be anywhere in it. The variance of that, along
/// each axis, of the widest light that explains the faces as well. (A shadow's edge tells that a lamp is small.)
double extent(const Fit& best, std::size_t which, const LightSearch& search) {
  std::vector<Lamp> beside = best.model.lamps;
  beside.erase(beside.begin() + static_cast<std::ptrdiff_t>(which));
  const Lamp& lamp = best.model.lamps[which];
  const double as_point = search.chi_square_of(lamp, 0, beside);
  double widest = 0;
  for (const double radius : kRadii)
    if (search.chi_square_of(lamp, radius, beside) < as_point + kAsGood) widest = radius;
  return widest * widest / 4;
}

/// Light from all around that would be less than nothing on some side stands in for light that the lamps do not explain.
double unexplained(const LightModel& model) {
  for (std::size_t c = 0; c < 3; ++c) {
    const double slope = std::hypot(model.ambient[1][c], model.ambient[2][c], model.ambient[3][c]);
    if (slope > model.ambient[0][c]) return kUnexplained * kUnexplained;
  }
  return 0;
}

Shading without(const Shading& shading, const Observations& seen, const Fit& fit, const ChoiceOptions& options, int& left_out) {
  Shading out = shading;
  out.samples.clear();
  const std::vector<double> of_faces = deviations_from(seen, fit.model);
  const auto most = static_cast<std::size_t>(kMostLeftOut * static_cast<double>(of_faces.size()));
  std::vector<double> sorted;
  for (const double d : of_faces) sorted.push_back(std::abs(d));
  std::sort(sorted.begin(), sorted.end(), std::greater<>());
  const double bound = std::max(options.outlier, sorted.empty() ? 0.0 : sorted[most]);
  for (std::size_t i = 0; i < of_faces.size(); ++i)
    if (std::abs(of_faces[i]) <= bound) out.samples.push_back(seen.of_faces()[i]);
  left_out = static_cast<int>(of_faces.size() - out.samples.size());
  if (shading.table && fit.table) {
    const std::vector<double> of_table = table_deviations_from(seen, fit, shading.hull);
    out.table->samples.clear();
    for (std::size_t i = 0; i < of_table.size(); ++i)
      if (std::abs(of_table[i]) <= options.outlier) out.table->samples.push_back(shading.table->samples[i]);
  }
  return out;
}

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

/// Whether the table's samples say where a lamp is: they fit a shadow, and without one they do not.
bool shadow_shows(const Observations& seen, const Fit& fit, const std::vector<Vec3d>& hull) {
  if (!fit.table || fit.model.lamps.empty() || seen.table()->size() < 30) return false;
  const std::vector<double> with = table_deviations_from(seen, fit, hull);
  if (rms(with) > kTableFits) return false;
  const Fit none = fit_lamps(seen, {}, {}, Witness::faces_and_table, hull, {});
  const std::vector<double> plain = table_deviations_from(seen, none, hull);
  double gain = 0;
  for (std::size_t i = 0; i < with.size(); ++i) gain += plain[i] * plain[i] - with[i] * with[i];
  return gain > kShadowShows;
}

/// A face without what lies over a part of it: light changes along a face like a plane, and most of its samples agree on one. The plane
/// through three samples from which the median differs least (Rousseeuw 1984, least median of squares). How many were left out.
int leave_out_covered(Shading& shading) {
  int left_out = 0;
  std::vector<SurfaceSample> kept;
  for (std::size_t begin = 0; begin < shading.samples.size();) {
    std::size_t end = begin;
    while (end < shading.samples.size() && shading.samples[end].surface == shading.samples[begin].surface) ++end;
    const std::span<const SurfaceSample> face(shading.samples.data() + begin, end - begin);
    begin = end;
    const Vec3d normal = face[0].normal;
    const bool flat = std::all_of(face.begin(), face.end(), [&](const SurfaceSample& s) { return dot(s.normal, normal) > 0.9999; });
    if (!flat || face.size() < 6) {
      kept.insert(kept.end(), face.begin(), face.end());
      continue;
    }
    const auto [u, v] = tangent_basis(normal);
    struct Point {
      double u, v, value;
    };
    std::vector<Point> points;
    for (const SurfaceSample& s : face)
      points.push_back({dot(s.position, u), dot(s.position, v), (s.irradiance[0] + s.irradiance[1] + s.irradiance[2]) / 3});
    std::vector<double> rest(points.size()), best(points.size(), 0), sorted;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t j = i + 1; j < points.size(); ++j)
        for (std::size_t k = j + 1; k < points.size(); ++k) {
          const Point &a = points[i], &b = points[j], &c = points[k];
          const double bu = b.u - a.u, bv = b.v - a.v, cu = c.u - a.u, cv = c.v - a.v, det = bu * cv - bv * cu;
          if (std::abs(det) < 0.1 * (bu * bu + bv * bv)) continue;
          const double gu = ((b.value - a.value) * cv - (c.value - a.value) * bv) / det;
          const double gv = ((c.value - a.value) * bu - (b.value - a.value) * cu) / det;
          for (std::size_t n = 0; n < points.size(); ++n)
            rest[n] = std::abs(points[n].value - a.value - gu * (points[n].u - a.u) - gv * (points[n].v - a.v));
          sorted = rest;
          const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
          std::nth_element(sorted.begin(), middle, sorted.end());
          if (*middle < least) least = *middle, best = rest;
        }
    sorted.clear();
    for (const Point& p : points) sorted.push_back(p.value);
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double bound = std::max(kOffPlane * std::abs(*middle), 4 * 1.4826 * least);
    for (std::size_t n = 0; n < points.size(); ++n) {
      if (!(best[n] > bound + 4 * (face[n].sigma[0] + face[n].sigma[1] + face[n].sigma[2]) / 3))
        kept.push_back(face[n]);
      else
        ++left_out;
    }
  }
  shading.samples = std::move(kept);
  return left_out;
}

/// In units in which the mean irradiance is one, and the table's mean radiance too: what a fit compares numbers with has a size.
struct Scaled {
  Shading shading;
  double irradiance = 0;  ///< One of those units.

  explicit Scaled(const Shading& from) : shading(from) {
    double sum = 0, table = 0;
    for (const SurfaceSample& s : from.samples) sum += (s.irradiance[0] + s.irradiance[1] + s.irradiance[2]) / 3;
    if (!from.samples.empty()) irradiance = sum / static_cast<double>(from.samples.size());
    if (!(irradiance > 0) || !std::isfinite(irradiance)) {
      irradiance = 0;
      return;
    }
    for (SurfaceSample& s : shading.samples)
      for (std::size_t c = 0; c < 3; ++c) s.irradiance[c] /= irradiance, s.sigma[c] /= irradiance, s.from_table[c] /= irradiance;
    if (!shading.table) return;
    for (const TableSample& t : shading.table->samples) table += t.radiance / static_cast<double>(shading.table->samples.size());
    if (!(table > 0) || !std::isfinite(table)) {
      shading.table.reset();
      return;
    }
    for (TableSample& t : shading.table->samples) t.radiance /= table, t.sigma /= table;
  }
};

/// What one witness, or both, tell: the fit that BIC takes, without the samples that are something else.
struct Told {  // `chooser` refers to `seen`, and to the hull of the shading that was asked about
  Shading kept;
  std::unique_ptr<Observations> seen;
  std::unique_ptr<Chooser> chooser;
  Sought sought;
  int left_out = 0;
  bool followed = false;
};

Told ask(const Shading& shading, Witness witness, const ChoiceOptions& options, const ChosenLight* before) {
  Told out;
  out.kept = shading;
  for (int round = 0;; ++round) {
    out.seen = std::make_unique<Observations>(out.kept, options.errors);
    out.chooser = std::make_unique<Chooser>(*out.seen, shading.hull, options, witness);
    std::optional<Sought> followed;
    if (before != nullptr) followed = out.chooser->follow(*before);
    out.followed = followed.has_value();
    out.sought = followed ? std::move(*followed) : out.chooser->seek();
    if (round == (out.followed ? 1 : kRounds)) return out;
    int left_out = 0;
    Shading fewer = without(out.kept, *out.seen, out.sought.best, options, left_out);
    const bool table_thinner = out.kept.table && fewer.table && fewer.table->samples.size() < out.kept.table->samples.size();
    if (left_out == 0 && !(round == 0 && table_thinner)) return out;
    out.left_out += left_out;
    out.kept = std::move(fewer);
  }
}

/// Whether what lies around the body is a table with a shadow on it.
bool is_witness(const Shading& shading, const Told& both) {
  const auto kept = static_cast<double>(both.kept.table->samples.size()), all = static_cast<double>(shading.table->samples.size());
  return kept >= kTableKept * all && shadow_shows(*both.seen, both.sought.best, both.kept.hull);
}

ChosenLight conclude(Told told, Witness witness, const ChoiceOptions& options, const ChosenLight* before) {
  ChosenLight out;
  const Fit& best = told.sought.best;
  out.left_out = told.left_out;
  out.used = told.seen->samples();
  out.shadow = witness == Witness::faces_and_table;
  out.followed = told.followed;
  out.ambient = best.model.ambient;
  out.chi_square = best.chi_square / std::max(1, best.observations - best.parameters);
  out.searched = told.followed ? before->searched : out.chi_square;
  const double spread = unexplained(best.model);
  out.placed = !best.model.lamps.empty() && (out.shadow || !(spread > 0));
  for (std::size_t k = 0; k < best.model.lamps.size(); ++k) {
    ChosenLamp lamp;
    lamp.lamp = best.model.lamps[k];
    Eigen::Matrix2d covariance = widened(told.sought, k, told.chooser->search(), witness);
    lamp.direction_covariance = {covariance(0, 0), covariance(0, 1), covariance(1, 1)};
    const auto worst_of = [](const Eigen::Matrix2d& c) { return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(c).eigenvalues()[1]); };
    // Whatever another model would make of the faces: a shadow needs its lamp.
    out.placed = out.placed && (out.shadow || worst_of(covariance) <= options.unsure_rad);
    if (witness == Witness::faces) covariance += (extent(best, k, told.chooser->search()) + spread) * Eigen::Matrix2d::Identity();
    const double worst = worst_of(covariance);
    lamp.unsure = !(worst <= options.unsure_rad);
    if (lamp.unsure) lamp.direction_covariance = {covariance(0, 0), covariance(0, 1), covariance(1, 1)};
    const double sigma = std::sqrt(best.covariance[k](2, 2));
    lamp.near = best.distances[k] == Distance::free && lamp.lamp.inverse_distance > 2 * sigma;
    lamp.inverse_distance_sigma = best.distances[k] == Distance::free ? sigma : std::numeric_limits<double>::infinity();
    out.lamps.push_back(lamp);
  }
  std::sort(out.lamps.begin(), out.lamps.end(), [](const ChosenLamp& a, const ChosenLamp& b) {
    return luminance(a.lamp.irradiance) > luminance(b.lamp.irradiance);
  });
  out.unsure = out.lamps.empty() || out.lamps[0].unsure;
  out.kept = std::move(told.kept.samples);
  return out;
}

/// What lies around the body is asked as a table with a shadow; as a table that shows none, but sends its light to the faces; and as
/// nothing of the kind, such as a room's far walls, which are a part of the light. Who told before is asked first.
ChosenLight choose(const Shading& shading, const ChoiceOptions& options, const ChosenLight* before) {
  Shading alone = shading;
  alone.table.reset();
  const int covered_alone = leave_out_covered(alone);
  const auto faces = [&](const Shading& of, int covered) {
    ChosenLight out = conclude(ask(of, Witness::faces, options, before), Witness::faces, options, before);
    out.left_out += covered;
    return out;
  };
  if (!shading.table || shading.table->samples.empty()) return faces(alone, covered_alone);
  Shading with_table = shading;
  take_out_table_light(with_table);
  const int covered = leave_out_covered(with_table);
  Shading lit_by_table = with_table;
  lit_by_table.table.reset();
  if (before != nullptr) {
    const Witness witness = before->shadow ? Witness::faces_and_table : Witness::faces;
    Told told = ask(before->shadow ? with_table : before->table_light ? lit_by_table : alone, witness, options, before);
    if (!told.followed) return choose(shading, options, nullptr);
    ChosenLight out = conclude(std::move(told), witness, options, before);
    out.left_out += before->table_light ? covered : covered_alone;
    out.table_light = before->table_light;
    return out;
  }
  Told both = ask(with_table, Witness::faces_and_table, options, nullptr);
  if (is_witness(shading, both)) {
    ChosenLight out = conclude(std::move(both), Witness::faces_and_table, options, nullptr);
    out.left_out += covered;
    out.table_light = true;
    return out;
  }
  ChosenLight out = faces(lit_by_table, covered);
  out.table_light = true;
  return out.unsure ? faces(alone, covered_alone) : out;
}

}  // namespace

ChosenLight choose_light(const Shading& shading, const ChoiceOptions& options, const ChosenLight* before) {
  Scaled scaled(shading);
  ChosenLight out;
  out.unsure = true;
  if (!(scaled.irradiance > 0)) return out;
  if (before != nullptr && before->lamps.empty()) before = nullptr;
  out = choose(scaled.shading, options, before);
  for (Rgb& coefficient : out.ambient)
    for (double& v : coefficient) v *= scaled.irradiance;
  for (ChosenLamp& lamp : out.lamps)
    for (double& v : lamp.lamp.irradiance) v *= scaled.irradiance;
  for (SurfaceSample& sample : out.kept)
    for (std::size_t c = 0; c < 3; ++c) sample.irradiance[c] *= scaled.irradiance, sample.sigma[c] *= scaled.irradiance;
  return out;
}

}  // namespace lightwell::marker
