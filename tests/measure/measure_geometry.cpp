// Calibrates simulated lenses many times and prints the errors and whether the stated covariances match them: one JSON
// object per line for tests/figures (figure, value, ...).
//   measure_geometry [TRIALS]     trials for each kind of lens, of noise and of pairs [100]; a quarter of that for each
//                                 board that differs from its description
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <numeric>
#include <string>

#include "firmware/calibration/lens_trials.hpp"

namespace {

using namespace lightwell;
using calibration::LensKind;
constexpr double kDegree = std::numbers::pi / 180;

void print(const std::string& figure, double value) {
  std::printf("{\"figure\": \"%s\", \"value\": %.6g}\n", figure.c_str(), value);
  std::fflush(stdout);
}

double median(std::vector<double> v) {
  if (v.empty()) return NAN;
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}
double largest(const std::vector<double>& v) { return v.empty() ? NAN : *std::max_element(v.begin(), v.end()); }
double least_share(const std::vector<int>& within, std::size_t of) {
  return within.empty() || of == 0
             ? NAN
             : static_cast<double>(*std::min_element(within.begin(), within.end())) / static_cast<double>(of);
}

/// Errors normalized by their stated standard deviations: RMS 1 if the covariance is right.
void print_normalized(const std::string& prefix, const shown::Trials& t) {
  print(prefix + "normalized.mean",
        std::accumulate(t.normalized.begin(), t.normalized.end(), 0.0) / static_cast<double>(t.normalized.size()));
  print(prefix + "normalized.least", *std::min_element(t.normalized.begin(), t.normalized.end()));
  print(prefix + "normalized.largest", largest(t.normalized));
  print(prefix + "normalized.direction", t.normalized_direction);
  print(prefix + "shaped", static_cast<double>(t.shaped) / t.count);
}

}  // namespace

int main(int argc, char** argv) {
  const int trials = argc > 1 ? std::atoi(argv[1]) : 100;
  if (argc > 2 || trials < 1) return std::fprintf(stderr, "usage: measure_geometry [TRIALS]\n"), 2;
  const std::pair<const char*, LensKind> kinds[] = {
      {"kannala_brandt", LensKind::kannala_brandt}, {"double_sphere", LensKind::double_sphere}, {"mei", LensKind::mei}};
  for (const auto& [name, kind] : kinds) {
    std::fprintf(stderr, "measure_geometry: %s\n", name);
    const shown::Trials t = shown::lens_trials(kind, trials, {});
    const std::string prefix = std::string("geometry.") + name + ".";
    print(prefix + "failed", t.failed);
    print(prefix + "direction_deg.median", median(t.direction_rad) / kDegree);
    print(prefix + "direction_deg.largest", largest(t.direction_rad) / kDegree);
    print(prefix + "direction_deg.share_within_0.05",
          static_cast<double>(std::count_if(t.direction_rad.begin(), t.direction_rad.end(),
                                            [](double e) { return e <= 0.05 * kDegree; })) /
              t.count);
    print(prefix + "focal.largest", largest(t.focal));
    print(prefix + "focal.median", median(t.focal));
    print(prefix + "within_3_sigma.least", least_share(t.within_3_sigma, t.direction_rad.size()));
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
    print(prefix + "direction_deg.largest", largest(t.direction_rad) / kDegree);
    print_normalized(prefix, t);
  }
  std::fprintf(stderr, "measure_geometry: pairs\n");
  const shown::Trials t = shown::pair_trials(trials, {.pictures = 40});
  std::vector<double> turn, shift;
  for (const shown::PairError& e : t.pair) turn.push_back(e.turn_rad / kDegree), shift.push_back(1e3 * e.shift_m);
  print("geometry.pair.failed", t.failed);
  print("geometry.pair.turn_deg.largest", largest(turn));
  print("geometry.pair.shift_mm.largest", largest(shift));
  print("geometry.pair.within_3_sigma.least", least_share(t.pair_within_3_sigma, t.pair.size()));
  return 0;
}
