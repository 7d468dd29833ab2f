// The error bound compared with closed forms for a uniform sphere of radiance L, whose irradiance is pi L.
#include "estimate/common/error_bound.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace lightwell::estimate {
namespace {

constexpr double kPi = std::numbers::pi;

Projection uniform_sphere(double radiance) {
  Projection out;
  out.c[0] = {radiance * std::sqrt(kSphere), radiance * std::sqrt(kSphere), radiance * std::sqrt(kSphere)};
  return out;
}

Flags flags_of(std::initializer_list<Flag> flags) {
  Flags out;
  for (const Flag flag : flags) out.set(flag);
  return out;
}

TEST(ErrorBound, TotalIsTheSumOfTheParts) {
  BoundParts parts;
  parts.truncation = 0.1, parts.sampling = 0.2, parts.noise = 0.3, parts.quantization = 0.4, parts.smoothing = 0.5;
  const ErrorBound bound = error_bound(parts, {});
  EXPECT_FLOAT_EQ(bound.total, 1.5F);
  EXPECT_FLOAT_EQ(bound.truncation, 0.1F);
  EXPECT_FLOAT_EQ(bound.sampling, 0.2F);
  EXPECT_FLOAT_EQ(bound.noise, 0.3F);
  EXPECT_FLOAT_EQ(bound.quantization, 0.4F);
  EXPECT_FLOAT_EQ(bound.smoothing, 0.5F);
}

TEST(ErrorBound, IsInfiniteWhereLightWasNotMeasured) {
  BoundParts parts;
  parts.noise = 0.1;
  for (const Flags flags :
       {flags_of({Flag::dark}), flags_of({Flag::unseen}), flags_of({Flag::clipped}),
        flags_of({Flag::unseen, Flag::filled}), flags_of({Flag::unseen, Flag::clipped, Flag::recovered})}) {
    EXPECT_TRUE(std::isinf(error_bound(parts, flags).total));
    EXPECT_FLOAT_EQ(error_bound(parts, flags).noise, 0.1F);
  }
  for (const Flags flags :
       {flags_of({}), flags_of({Flag::clipped, Flag::recovered}), flags_of({Flag::cleaned, Flag::moved, Flag::unsure})})
    EXPECT_FLOAT_EQ(error_bound(parts, flags).total, 0.1F);
}

TEST(ErrorBound, RelativeErrorsOfAUniformSphere) {
  const IntegrationErrors errors{6e-4, 0.04, 0.001, 0.002};
  const RelativeErrors got = relative_errors(uniform_sphere(2), errors, 1, 0.005);
  EXPECT_NEAR(got.rms, 2 * kPi, 1e-6);
  EXPECT_NEAR(noise_rms(errors), 0.01, 1e-12);
  EXPECT_NEAR(got.noise, 0.01 / (2 * kPi), 1e-9);
  EXPECT_NEAR(got.near_black_bias, 0.01 / (2 * kPi), 1e-9);
  EXPECT_NEAR(got.sampling, 0.005 + 0.003 / std::sqrt(6.0) / (2 * kPi), 1e-9);
  EXPECT_NEAR(got.expected(), std::hypot(got.noise, 0.3 * got.sampling), 1e-12);
  EXPECT_FALSE(got.dark());
}

TEST(ErrorBound, RelativeErrorsDoNotDependOnTheUnits) {
  const IntegrationErrors errors{1e-3, 0.02, 0.001, 0.002};
  const RelativeErrors one = relative_errors(uniform_sphere(2), errors, 1, 0.005);
  const RelativeErrors scaled = relative_errors(uniform_sphere(2 * 50), errors, 50, 0.005);
  EXPECT_NEAR(scaled.rms, 50 * one.rms, 1e-4);
  EXPECT_NEAR(scaled.noise, one.noise, 1e-9);
  EXPECT_NEAR(scaled.near_black_bias, one.near_black_bias, 1e-9);
  EXPECT_NEAR(scaled.sampling, one.sampling, 1e-9);
}

TEST(ErrorBound, IsDarkWhereNoiseAndBiasEqualTheLight) {
  // Three sigma of noise and the bias, as shares of the irradiance.
  const auto dark = [](double noise, double bias) {
    const IntegrationErrors errors{6 * std::pow(noise / 3 * kPi, 2), 4 * bias * kPi, 0, 0};
    return relative_errors(uniform_sphere(1), errors, 1, 0).dark();
  };
  EXPECT_FALSE(dark(0.99, 0));
  EXPECT_TRUE(dark(1.01, 0));
  EXPECT_FALSE(dark(0.4, 0.59));
  EXPECT_TRUE(dark(0.4, 0.61));
  const RelativeErrors none = relative_errors(uniform_sphere(0), {1, 1, 1, 1}, 1, 0.005);
  EXPECT_TRUE(none.dark());
  EXPECT_EQ(none.noise, 0);
  EXPECT_EQ(none.sampling, 0);
}

TEST(ErrorBound, AddsDirectionsRecoverySmoothingAndTruncation) {
  const RelativeErrors errors = relative_errors(uniform_sphere(1), {6e-6, 0, 0, 0}, 1, 0.01);
  OptimizedDescriptor optimized;
  optimized.scene_rms = {kPi, kPi};
  optimized.truncation = {0.02 * kPi, 0.01 * kPi};
  Descriptor d;
  const ErrorBound without = error_bound(d, errors, optimized, {}, 0);
  EXPECT_NEAR(without.truncation, 0.02, 1e-6);
  EXPECT_NEAR(without.sampling, 0.01, 1e-6);
  EXPECT_NEAR(without.noise, 3 * 0.001 / kPi, 1e-6);
  EXPECT_EQ(without.smoothing, 0);
  // A light of irradiance 2 whose direction has a standard deviation of 0.01 rad along both axes; three sigma.
  d.lights.push_back({{0, 1, 0}, {2, 2, 2}, 0.01F, {1e-4F, 0, 1e-4F}, 1});
  const ErrorBound with_light = error_bound(d, errors, optimized, {0.05 * kPi, 0.04 * kPi}, 0.3);
  EXPECT_NEAR(with_light.sampling - without.sampling, 3 * std::sqrt(2e-4 / 6) * 2 / kPi + 0.3 / std::sqrt(6.0) / kPi,
              1e-6);
  EXPECT_NEAR(with_light.smoothing, 0.05 - with_light.noise, 1e-6) << "noise that smoothing removes does not count";
  EXPECT_GT(with_light.quantization, 0);
  EXPECT_NEAR(
      with_light.total,
      with_light.truncation + with_light.sampling + with_light.noise + with_light.quantization + with_light.smoothing,
      1e-6);
}

TEST(ErrorBound, OfADarkFrameHasNoParts) {
  Descriptor d;
  d.flags.set(Flag::dark);
  OptimizedDescriptor optimized;
  optimized.truncation = {1, 1};
  const ErrorBound bound = error_bound(d, {}, optimized, {}, 0);
  EXPECT_TRUE(std::isinf(bound.total));
  EXPECT_EQ(bound.truncation, 0);
  EXPECT_EQ(bound.sampling, 0);
}

TEST(ErrorBound, SmallLightsOfSharedColourAreUncertain) {
  const std::vector<CellSum> grey_room(100, CellSum{1, 1, 1});
  const double grey[3] = {1, 1, 1}, red[3] = {1, 0, 0};
  EXPECT_NEAR(chroma_edge_error(grey, 1, grey_room), 0, 1e-6) << "it has the colour of its surroundings";
  EXPECT_NEAR(chroma_edge_error(red, 1, grey_room), 0.6 * (1 - 0.2126), 1e-4);
  EXPECT_NEAR(mosaic_edge_error(grey, 1), 0.6 * 0.886, 1e-4);
  // n samples have 2 sqrt(pi n) at the edge: sqrt(2 sqrt(pi)) n^-0.75.
  EXPECT_NEAR(mosaic_edge_error(grey, 100), 0.6 * 0.886 * std::sqrt(2 * std::sqrt(kPi)) * std::pow(100, -0.75), 1e-5);
}

}  // namespace
}  // namespace lightwell::estimate
