#include "firmware/calibration/photometry/trials.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "calibration/model/response.hpp"
#include "calibration/solve/photometry/noise.hpp"
#include "calibration/solve/photometry/picture.hpp"
#include "calibration/solve/photometry/response_solver.hpp"
#include "calibration/solve/photometry/vignetting.hpp"
#include "firmware/calibration/photometry/simulated_camera.hpp"

namespace lightwell::photometry {
namespace {

PixelFormat format_of(int bits) { return bits == 8 ? PixelFormat::rgb8 : PixelFormat::bayer_rggb12; }

class Tally {
 public:
  explicit Tally(std::string name) { figure_.name = std::move(name); }

  void add(double error, bool inside) {
    figure_.worst = std::max(figure_.worst, std::abs(error));
    inside_ += inside ? 1 : 0;
    ++figure_.trials;
  }
  /// A trial without a result counts as an infinite error.
  void fail() { add(1e9, false); }
  void within(double found, double truth, double deviation, double unit) {
    add((found - truth) / unit, std::abs(found - truth) <= 3 * deviation);
  }

  [[nodiscard]] ParameterFigure figure() const {
    ParameterFigure out = figure_;
    out.inside = figure_.trials > 0 ? static_cast<double>(inside_) / figure_.trials : 0;
    return out;
  }

 private:
  ParameterFigure figure_;
  int inside_ = 0;
};

PhotometricCalibration photometry_of(ResponseCase which) {
  const bool eight = which == ResponseCase::srgb8 || which == ResponseCase::gamma8 || which == ResponseCase::toe8;
  PhotometricCalibration p = usual_photometry(format_of(eight ? 8 : 12));
  const double dark_value = eight ? 0 : 256.0 / 4095;
  switch (which) {
    case ResponseCase::srgb8:
    case ResponseCase::linear12:
      break;
    case ResponseCase::gamma8:
    case ResponseCase::gamma12:
      p.response.kind = ResponseCurve::Kind::gamma;
      p.response.gamma = which == ResponseCase::gamma8 ? 1.8 : 1.45;
      break;
    case ResponseCase::toe8:
    case ResponseCase::toe12:
      p.response.kind = ResponseCurve::Kind::table;
      for (int i = 0; i <= 1024; ++i) p.response.inverse.push_back(toe_and_shoulder(i / 1024.0));
      break;
  }
  p.black_level = linearized(p.response, dark_value);
  return p;
}

double x_of(const PhotometricCalibration& p, double value) {
  return (linearized(p.response, value) - p.black_level) / (1 - p.black_level);
}

}  // namespace

const char* to_string(ResponseCase which) {
  switch (which) {
    case ResponseCase::srgb8:
      return "srgb8";
    case ResponseCase::gamma8:
      return "gamma8";
    case ResponseCase::toe8:
      return "toe8";
    case ResponseCase::linear12:
      return "linear12";
    case ResponseCase::gamma12:
      return "gamma12";
    case ResponseCase::toe12:
      return "toe12";
  }
  return "unknown";
}

std::vector<ParameterFigure> response_trials(ResponseCase which, int trials) {
  const PhotometricCalibration truth = photometry_of(which);
  const bool eight = which == ResponseCase::srgb8 || which == ResponseCase::gamma8 || which == ResponseCase::toe8;
  const double dark_value = eight ? 0 : 256.0 / 4095;
  Tally curve("curve"), gamma("gamma"), kind("kind");
  std::vector<Tally> knots;
  for (int trial = 0; trial < trials; ++trial) {
    SimulatedCamera camera(format_of(eight ? 8 : 12), truth, 1000 + static_cast<std::uint64_t>(trial));
    std::vector<Picture> pictures;
    std::vector<double> exposures;
    std::mt19937_64 random(1000 + static_cast<std::uint64_t>(trial));
    std::normal_distribution<double> normal;
    for (int j = 0; j < 9; ++j) {
      // A moving object: a different square of light in each picture.
      const int walker = (7 * j + 13 * trial) % 28 * 6;
      exposures.push_back(0.6e-3 * std::pow(2.0, j));
      pictures.push_back(camera.shoot([&](int x, int y) { return x >= walker && x < walker + 10 ? 3.0 : shades(x, y); },
                                      exposures.back() * (1 + 0.001 * normal(random))));
    }
    const auto samples = choose_samples(pictures, exposures, dark_value, truth.saturation);
    const auto found = samples ? solve_response(*samples) : Result<ResponseEstimate>(samples.status());
    if (!found) {
      std::fprintf(stderr, "%s, trial %d: %s\n", to_string(which), trial, found.status().message().c_str());
      curve.fail();
      continue;
    }
    PhotometricCalibration measured = truth;
    measured.response = found->response;
    measured.black_level = found->black_level;
    double squares = 0;
    constexpr int kPoints = 256;
    for (int i = 0; i < kPoints; ++i) {
      const double v = dark_value + (1 - dark_value) * i / (kPoints - 1);
      squares += std::pow(x_of(measured, v) - x_of(truth, v), 2) / kPoints;
    }
    curve.add(std::sqrt(squares), true);
    kind.add(0, found->response.kind == truth.response.kind);
    if (truth.response.kind == ResponseCurve::Kind::gamma) {
      if (found->response.kind == ResponseCurve::Kind::gamma)
        gamma.within(found->response.gamma, truth.response.gamma, found->gamma_deviation, truth.response.gamma);
      else
        gamma.fail();
    }
    // The covariance of the free curve is only relevant if that is the result.
    if (found->response.kind != ResponseCurve::Kind::table) continue;
    const std::size_t n = found->knot_value.size();
    for (std::size_t k = 0; k + 1 < n; ++k) {
      // The first knot is dark, where x is 0 by definition.
      if (knots.size() < k + 1) knots.emplace_back("knot");
      knots[k].within(found->knot_linear[k], x_of(truth, found->knot_value[k]),
                      std::sqrt(found->knot_covariance[k * n + k]), 1);
    }
  }
  ParameterFigure worst{"worst_knot", 0, 1, trials};
  for (std::size_t k = 1; k < knots.size(); ++k) {
    worst.worst = std::max(worst.worst, knots[k].figure().worst);
    worst.inside = std::min(worst.inside, knots[k].figure().inside);
  }
  std::vector<ParameterFigure> out{curve.figure(), kind.figure()};
  if (truth.response.kind == ResponseCurve::Kind::table) out.push_back(worst);
  if (truth.response.kind == ResponseCurve::Kind::gamma) out.push_back(gamma.figure());
  return out;
}

std::vector<ParameterFigure> noise_trials(int bits, int trials) {
  const PhotometricCalibration truth = usual_photometry(format_of(bits));
  Tally black("black"), read("read"), read_noise("read_noise"), shot_noise("shot_noise");
  for (int trial = 0; trial < trials; ++trial) {
    SimulatedCamera camera(format_of(bits), truth, 5000 + static_cast<std::uint64_t>(trial));
    const auto dark = solve_dark(camera.darks(4), truth.response);
    if (!dark) {
      for (Tally* t : {&black, &read, &read_noise, &shot_noise}) t->fail();
      continue;
    }
    black.within(dark->black_level, truth.black_level, dark->black_deviation, 1);
    read.within(dark->read_noise, truth.read_noise, dark->read_deviation, truth.read_noise);
    PhotometricCalibration measured = truth;
    measured.black_level = dark->black_level;
    const auto levels = noise_levels(camera.flats({0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8}), measured);
    const auto noise = levels ? solve_noise(*levels, *dark) : Result<NoiseEstimate>(levels.status());
    if (!noise) {
      std::fprintf(stderr, "noise, trial %d: %s\n", trial, noise.status().message().c_str());
      read_noise.fail();
      shot_noise.fail();
      continue;
    }
    read_noise.within(noise->read_noise, truth.read_noise, noise->read_deviation, truth.read_noise);
    shot_noise.within(noise->shot_noise, truth.shot_noise, noise->shot_deviation, truth.shot_noise);
  }
  return {black.figure(), read.figure(), read_noise.figure(), shot_noise.figure()};
}

std::vector<ParameterFigure> vignetting_trials(int trials) {
  constexpr double kField = 95 * std::numbers::pi / 180;
  constexpr double kNoise = 0.003;
  PhotometricCalibration truth;
  truth.vignetting = {-0.25, 0.05, -0.006};
  Tally edge("edge");
  std::array<Tally, 3> v{Tally("v1"), Tally("v2"), Tally("v3")};
  for (int trial = 0; trial < trials; ++trial) {
    std::mt19937_64 random(9000 + static_cast<std::uint64_t>(trial));
    std::normal_distribution<double> normal;
    std::vector<LampObservation> observations;
    for (int i = 0; i < 50; ++i) {
      const double angle = kField * i / 49;
      const double wrong = i % 17 == 5 ? 1.3 : 1;  // An outlier.
      observations.push_back({angle, 42 * vignetting(truth, angle) * (1 + kNoise * normal(random)) * wrong, 0});
    }
    const auto found = solve_vignetting(observations, kField);
    if (!found) {
      edge.fail();
      continue;
    }
    PhotometricCalibration measured;
    measured.vignetting = found->vignetting;
    double largest = 0;
    for (int i = 0; i <= 200; ++i) {
      const double angle = kField * i / 200;
      largest = std::max(largest, std::abs(vignetting(measured, angle) / vignetting(truth, angle) - 1));
    }
    edge.add(largest, true);
    for (std::size_t k = 0; k < 3; ++k)
      v[k].within(found->vignetting[k], truth.vignetting[k], std::sqrt(found->covariance[4 * k]), 1);
  }
  return {edge.figure(), v[0].figure(), v[1].figure(), v[2].figure()};
}

std::vector<ParameterFigure> card_trials(int bits, int trials) {
  PhotometricCalibration truth = usual_photometry(format_of(bits));
  truth.white_balance = {1.9, 1, 1.4};
  Tally red("red"), blue("blue"), scale("scale");
  constexpr double kMeter = 0.04, kRadiance = 800, kNitsPerUnit = 1;
  for (int trial = 0; trial < trials; ++trial) {
    SimulatedCamera camera(format_of(bits), truth, 13000 + static_cast<std::uint64_t>(trial));
    std::mt19937_64 random(13000 + static_cast<std::uint64_t>(trial));
    const double meter = 1 + kMeter * std::normal_distribution<double>()(random);
    const Picture card = camera.shoot([](int, int) { return kRadiance; }, 0.5e-3, 2);
    const auto patch = patch_mean(card, {60, 30, 40, 40}, truth, "card");
    const auto balance = patch ? solve_white_balance(*patch) : Result<WhiteBalance>(patch.status());
    const auto reading = luminance_reading(kRadiance * meter, kMeter);
    const auto absolute = balance && reading ? solve_absolute_scale(*patch, balance->factors, {0.5e-3, 2, 1}, *reading)
                                             : Result<AbsoluteScale>(balance.status());
    if (!absolute) {
      for (Tally* t : {&red, &blue, &scale}) t->fail();
      continue;
    }
    red.within(balance->factors[0], 1.9, std::sqrt(balance->covariance[0]), 1.9);
    blue.within(balance->factors[2], 1.4, std::sqrt(balance->covariance[3]), 1.4);
    // Exclude the error of the meter.
    scale.add(absolute->nits_per_unit / meter / kNitsPerUnit - 1,
              std::abs(absolute->nits_per_unit - kNitsPerUnit) <= 3 * absolute->deviation);
  }
  return {red.figure(), blue.figure(), scale.figure()};
}

}  // namespace lightwell::photometry
