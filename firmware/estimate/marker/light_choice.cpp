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

#include "estimate/marker/covered_samples.hpp"
#include "estimate/marker/lamp_chooser.hpp"
#include "estimate/marker/lamp_doubt.hpp"
#include "estimate/marker/table_light.hpp"

namespace lightwell::marker {
namespace {

/// Of the samples, at most so many may be something else; more, and the model is what is wrong.
constexpr double kMostLeftOut = 0.35;
/// So many times are samples left out and the rest asked again.
constexpr int kRounds = 2;
/// The table is one plane of one colour where its samples differ from the model by no more than so many deviations,
/// RMS,
constexpr double kTableFits = 0.35;
/// without leaving out more than a few of them,
constexpr double kTableKept = 0.8;
/// and it shows a shadow where that explains so much more than none (a difference of chi squares).
constexpr double kShadowShows = 30;

Shading without(const Shading& shading, const Observations& seen, const Fit& fit, const ChoiceOptions& options,
                int& left_out) {
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

/// In units in which the mean irradiance is one, and the table's mean radiance too: what a fit compares numbers with
/// has a size.
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
      for (std::size_t c = 0; c < 3; ++c)
        s.irradiance[c] /= irradiance, s.sigma[c] /= irradiance, s.from_table[c] /= irradiance;
    if (!shading.table) return;
    for (const TableSample& t : shading.table->samples)
      table += t.radiance / static_cast<double>(shading.table->samples.size());
    if (!(table > 0) || !std::isfinite(table)) {
      shading.table.reset();
      return;
    }
    for (TableSample& t : shading.table->samples) t.radiance /= table, t.sigma /= table;
  }
};

/// What is told where what lies around the body is taken for that: the fit that BIC takes, without the samples that are
/// something else.
struct Told {  // `chooser` refers to `seen`, and to the hull of the shading that was asked about
  Around around = Around::far;
  Shading kept;
  std::unique_ptr<Observations> seen;
  std::unique_ptr<LampChooser> chooser;
  Sought sought;
  int left_out = 0;
};

Witness witness_of(Around around) { return around == Around::shadow ? Witness::faces_and_table : Witness::faces; }

/// `before`: its lamps are followed; nothing where they do not explain this frame. Null: lamps are looked for
/// everywhere.
std::optional<Told> ask(const Shading& shading, Around around, const ChoiceOptions& options,
                        const ChosenLight* before) {
  Told out;
  out.around = around;
  out.kept = shading;
  if (around != Around::far) take_out_table_light(out.kept);
  if (around != Around::shadow) out.kept.table.reset();
  out.left_out = leave_out_covered(out.kept);
  for (int round = 0;; ++round) {
    out.seen = std::make_unique<Observations>(out.kept, options.errors);
    out.chooser = std::make_unique<LampChooser>(*out.seen, shading.hull, options, witness_of(around));
    if (before != nullptr) {
      std::optional<Sought> followed = out.chooser->follow(*before);
      if (!followed) return std::nullopt;
      out.sought = std::move(*followed);
    } else {
      out.sought = out.chooser->seek();
    }
    if (round == (before != nullptr ? 1 : kRounds)) return out;
    int left_out = 0;
    Shading fewer = without(out.kept, *out.seen, out.sought.best, options, left_out);
    const bool table_thinner =
        out.kept.table && fewer.table && fewer.table->samples.size() < out.kept.table->samples.size();
    if (left_out == 0 && !(round == 0 && table_thinner)) return out;
    out.left_out += left_out;
    out.kept = std::move(fewer);
  }
}

/// Whether what lies around the body is a table with a shadow on it.
bool is_witness(const Shading& shading, const Told& both) {
  const auto kept = static_cast<double>(both.kept.table->samples.size()),
             all = static_cast<double>(shading.table->samples.size());
  return kept >= kTableKept * all && shadow_shows(*both.seen, both.sought.best, both.kept.hull);
}

std::array<double, 3> numbers(const Eigen::Matrix2d& m) { return {m(0, 0), m(0, 1), m(1, 1)}; }

Eigen::Matrix2d matrix(const std::array<double, 3>& numbers) {
  Eigen::Matrix2d out;
  out << numbers[0], numbers[1], numbers[1], numbers[2];
  return out;
}

/// `before`: whose lamps were followed, in their order; null where they were looked for.
ChosenLight conclude(Told told, const ChoiceOptions& options, const ChosenLight* before) {
  const Witness witness = witness_of(told.around);
  const bool shadow = told.around == Around::shadow;
  ChosenLight out;
  const Fit& best = told.sought.best;
  out.left_out = told.left_out;
  out.used = told.seen->samples();
  out.around = told.around;
  out.followed = before != nullptr;
  out.ambient = best.model.ambient;
  out.chi_square = best.chi_square / std::max(1, best.observations - best.parameters);
  out.searched = before != nullptr ? before->searched : out.chi_square;
  const double spread = unexplained(best.model);
  out.placed = !best.model.lamps.empty() && (shadow || !(spread > 0));
  for (std::size_t k = 0; k < best.model.lamps.size(); ++k) {
    ChosenLamp lamp;
    lamp.lamp = best.model.lamps[k];
    const Eigen::Matrix2d models = before != nullptr ? carried(matrix(before->lamps[k].of_models),
                                                               before->lamps[k].lamp.direction, lamp.lamp.direction)
                                                     : over_models(told.sought, k);
    Eigen::Matrix2d covariance = over_places(best, k, told.chooser->search(), witness) + models;
    lamp.of_models = numbers(models);
    lamp.direction_covariance = numbers(covariance);
    const auto worst_of = [](const Eigen::Matrix2d& c) {
      return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(c).eigenvalues()[1]);
    };
    // Whatever another model would make of the faces: a shadow needs its lamp.
    out.placed = out.placed && (shadow || worst_of(covariance) <= options.unsure_rad);
    if (!shadow) covariance += (extent(best, k, told.chooser->search()) + spread) * Eigen::Matrix2d::Identity();
    const double worst = worst_of(covariance);
    lamp.unsure = !(worst <= options.unsure_rad);
    if (lamp.unsure) lamp.direction_covariance = numbers(covariance);
    const double sigma = std::sqrt(best.covariance[k](2, 2));
    lamp.free = best.distances[k] == Distance::free;
    lamp.near = lamp.free && lamp.lamp.inverse_distance > 2 * sigma;
    lamp.inverse_distance_sigma = lamp.free ? sigma : std::numeric_limits<double>::infinity();
    out.lamps.push_back(lamp);
  }
  std::sort(out.lamps.begin(), out.lamps.end(), [](const ChosenLamp& a, const ChosenLamp& b) {
    return luminance(a.lamp.irradiance) > luminance(b.lamp.irradiance);
  });
  out.unsure = out.lamps.empty() || out.lamps[0].unsure;
  out.kept = std::move(told.kept.samples);
  return out;
}

/// Who told before is asked first. Else what lies around the body is asked as a table with a shadow; as a table that
/// shows none, but sends its light to the faces; and, where that makes no lamp sure, as nothing of the kind.
ChosenLight choose(const Shading& shading, const ChoiceOptions& options, const ChosenLight* before) {
  const bool table = shading.table && !shading.table->samples.empty();
  if (before != nullptr)
    if (std::optional<Told> told = ask(shading, table ? before->around : Around::far, options, before))
      return conclude(std::move(*told), options, before);
  const auto search = [&](Around around) { return *ask(shading, around, options, nullptr); };
  if (table) {
    Told both = search(Around::shadow);
    if (is_witness(shading, both)) return conclude(std::move(both), options, nullptr);
    ChosenLight out = conclude(search(Around::table), options, nullptr);
    if (!out.unsure) return out;
  }
  return conclude(search(Around::far), options, nullptr);
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
