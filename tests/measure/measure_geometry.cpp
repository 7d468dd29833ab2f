// Calibrates simulated lenses many times and prints the errors and whether the stated covariances match them: one JSON
// object per line for tests/figures (figure, value, ...).
//   measure_geometry [TRIALS]     trials for each kind of lens, of noise and of pairs [100]; a quarter of that for each
//                                 board that differs from its description
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>
#include <string>

#include <lightwell/quantile.hpp>

#include "firmware/calibration/lens_trials.hpp"
#include "measure/output.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
using calibration::LensKind;
using measure::print_figure;
constexpr double kDegree = std::numbers::pi / 180;

double largest(const std::vector<double>& v) { return v.empty() ? NAN : *std::max_element(v.begin(), v.end()); }
double least_share(const std::vector<int>& within, std::size_t of) {
  return within.empty() || of == 0
             ? NAN
             : static_cast<double>(*std::min_element(within.begin(), within.end())) / static_cast<double>(of);
}

/// Errors normalized by their stated standard deviations: RMS 1 if the covariance is right.
void print_normalized(const std::string& prefix, const shown::Trials& t) {
  print_figure(prefix + "normalized.mean", std::accumulate(t.normalized.begin(), t.normalized.end(), 0.0) /
                                               static_cast<double>(t.normalized.size()));
  print_figure(prefix + "normalized.least", *std::min_element(t.normalized.begin(), t.normalized.end()));
  print_figure(prefix + "normalized.largest", largest(t.normalized));
  print_figure(prefix + "normalized.direction", t.normalized_direction);
  print_figure(prefix + "shaped", static_cast<double>(t.shaped) / t.count);
}

}  // namespace

int main(int argc, char** argv) {
  int trials = 100;
  CLI::App app{"Errors of calibrated lenses, and whether the stated covariances match them.", "measure_geometry"};
  app.add_option("TRIALS", trials, "Trials for each kind of lens [100]")->check(CLI::PositiveNumber);
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  const std::pair<const char*, LensKind> kinds[] = {
      {"kannala_brandt", LensKind::kannala_brandt}, {"double_sphere", LensKind::double_sphere}, {"mei", LensKind::mei}};
  for (const auto& [name, kind] : kinds) {
    std::fprintf(stderr, "measure_geometry: %s\n", name);
    const shown::Trials t = shown::lens_trials(kind, trials, {});
    const std::string prefix = std::string("geometry.") + name + ".";
    print_figure(prefix + "failed", t.failed);
    print_figure(prefix + "direction_deg.median", upper_quantile(std::vector(t.direction_rad), 0.5) / kDegree);
    print_figure(prefix + "direction_deg.largest", largest(t.direction_rad) / kDegree);
    print_figure(prefix + "direction_deg.share_within_0.05",
                 static_cast<double>(std::count_if(t.direction_rad.begin(), t.direction_rad.end(),
                                                   [](double e) { return e <= 0.05 * kDegree; })) /
                     t.count);
    print_figure(prefix + "focal.largest", largest(t.focal));
    print_figure(prefix + "focal.median", upper_quantile(std::vector(t.focal), 0.5));
    print_figure(prefix + "within_3_sigma.least", least_share(t.within_3_sigma, t.direction_rad.size()));
    print_normalized(prefix, t);
  }
  const std::pair<const char*, shown::Noise> noises[] = {{"contaminated", shown::Noise::contaminated},
                                                         {"by_picture", shown::Noise::by_picture},
                                                         {"within_tag", shown::Noise::within_tag}};
  for (const auto& [name, noise] : noises) {
    std::fprintf(stderr, "measure_geometry: noise %s\n", name);
    print_normalized(std::string("geometry.noise.") + name + ".",
                     shown::lens_trials(LensKind::kannala_brandt, trials, {.noise = noise}));
  }
  const std::pair<const char*, shown::Show> boards[] = {{"cylinder", {.bend = shown::Bend::cylinder}},
                                                        {"sphere", {.bend = shown::Bend::sphere}},
                                                        {"spacing", {.spacing = 0.32}}};
  for (const auto& [name, show] : boards) {
    std::fprintf(stderr, "measure_geometry: board %s\n", name);
    const shown::Trials t = shown::lens_trials(LensKind::kannala_brandt, (trials + 3) / 4, show);
    const std::string prefix = std::string("geometry.board.") + name + ".";
    print_figure(prefix + "direction_deg.largest", largest(t.direction_rad) / kDegree);
    print_normalized(prefix, t);
  }
  std::fprintf(stderr, "measure_geometry: pairs\n");
  const shown::Trials t = shown::pair_trials(trials, {.pictures = 40});
  std::vector<double> turn, shift;
  for (const shown::PairError& e : t.pair) turn.push_back(e.turn_rad / kDegree), shift.push_back(1e3 * e.shift_m);
  print_figure("geometry.pair.failed", t.failed);
  print_figure("geometry.pair.turn_deg.largest", largest(turn));
  print_figure("geometry.pair.shift_mm.largest", largest(shift));
  print_figure("geometry.pair.within_3_sigma.least", least_share(t.pair_within_3_sigma, t.pair.size()));
  return 0;
}
