// Direction covariances on the wire are positive semi-definite, and readers repair those of old messages.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/codec.hpp>

#include "lightwell/v1/descriptor.pb.h"

namespace lightwell {
namespace {

/// u·u, u·v, v·v.
using Covariance = std::array<float, 3>;
using Mantissas = std::array<int, 3>;

struct WireLight {
  Mantissas mantissa{};  ///< As a reader expands them: one number stands for u·u and v·v.
  int numbers = 0;
  int exponent = 0;
};

/// Exact: products of floats and of mantissas are exact in double.
template <class T>
bool positive_semidefinite(const std::array<T, 3>& m) {
  const auto uu = static_cast<double>(m[0]), uv = static_cast<double>(m[1]), vv = static_cast<double>(m[2]);
  return uu >= 0 && vv >= 0 && uv * uv <= uu * vv;
}

double smallest_eigenvalue(double uu, double uv, double vv) { return (uu + vv) / 2 - std::hypot((uu - vv) / 2, uv); }

std::string encoded(const std::vector<Covariance>& covariances) {
  Descriptor d;
  d.coverage = 1;
  for (const Covariance& covariance : covariances) {
    Light light;
    light.direction = {0, 1, 0};
    light.direction_covariance = covariance;
    d.lights.push_back(light);
  }
  Encoder encoder;
  const auto bytes = encoder.encode(d);
  EXPECT_TRUE(bytes.ok()) << bytes.status().message();
  return bytes.ok() ? std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()) : std::string();
}

std::vector<Covariance> decoded(const std::string& bytes) {
  const auto d = decode_descriptor(std::as_bytes(std::span(bytes)));
  EXPECT_TRUE(d.ok()) << d.status().message();
  std::vector<Covariance> out;
  if (d.ok())
    for (const Light& light : d->lights) out.push_back(light.direction_covariance);
  return out;
}

std::vector<WireLight> mantissas_in(const std::string& bytes) {
  v1::LightingDescriptor m;
  EXPECT_TRUE(m.ParseFromString(bytes));
  std::vector<WireLight> out;
  for (const v1::Light& light : m.lights()) {
    WireLight sent{{}, light.covariance_mantissa_size(), light.covariance_exponent()};
    for (int k = 0; k < sent.numbers; ++k) sent.mantissa[static_cast<std::size_t>(k)] = light.covariance_mantissa(k);
    if (sent.numbers == 1) sent.mantissa[2] = sent.mantissa[0];
    out.push_back(sent);
  }
  return out;
}

/// What a reader makes of a message with these mantissas, as an old probe sent them.
Covariance received(std::span<const int> mantissas, int exponent) {
  v1::LightingDescriptor m;
  const std::string bytes = encoded({Covariance{}});
  EXPECT_TRUE(m.ParseFromString(bytes));
  for (const int mantissa : mantissas) m.mutable_lights(0)->add_covariance_mantissa(mantissa);
  m.mutable_lights(0)->set_covariance_exponent(exponent);
  const std::vector<Covariance> out = decoded(m.SerializeAsString());
  return out.empty() ? Covariance{} : out[0];
}

/// Each element rounded to the nearest, with the finest step for which the largest is at most 63.
WireLight nearest_mantissas(const Covariance& c) {
  WireLight out{{}, 3, -150};
  const double largest = std::max({std::abs(c[0]), std::abs(c[1]), std::abs(c[2])});
  while (std::nearbyint(std::ldexp(largest, -out.exponent)) > 63) ++out.exponent;
  for (std::size_t k = 0; k < 3; ++k)
    out.mantissa[k] = static_cast<int>(std::nearbyint(std::ldexp(static_cast<double>(c[k]), -out.exponent)));
  return out;
}

/// The nearest positive semi-definite matrix to an indefinite one, by search. It is on the boundary of the convex cone,
/// a multiple k >= 0 of e e' with e = (cos a, sin a); the best k for an angle is e' m e, and the best angle has the
/// largest.
std::array<double, 3> nearest_by_search(const Mantissas& m) {
  const auto along = [&](double a) {
    return m[0] * std::cos(a) * std::cos(a) + 2 * m[1] * std::cos(a) * std::sin(a) + m[2] * std::sin(a) * std::sin(a);
  };
  constexpr int kAngles = 64;
  constexpr double kStep = std::numbers::pi / kAngles;
  double best = 0;
  for (int i = 1; i < kAngles; ++i)
    if (along(i * kStep) > along(best)) best = i * kStep;
  double low = best - kStep, high = best + kStep;
  for (int i = 0; i < 60; ++i) {
    const double third = (high - low) / 3;
    if (along(low + third) < along(high - third))
      low += third;
    else
      high -= third;
  }
  const double a = (low + high) / 2, k = std::max(0.0, along(a));
  return {k * std::cos(a) * std::cos(a), k * std::cos(a) * std::sin(a), k * std::sin(a) * std::sin(a)};
}

/// Positive semi-definite matrices of all sizes, orientations and ratios of their variances, in groups for a message.
/// Those of rank one are so within the rounding of floats.
std::vector<std::vector<Covariance>> random_covariances(double smallest_log2, double largest_log2) {
  constexpr std::array kRatios = {0.0, 1e-12, 1e-7, 1e-5, 1e-3, 3e-3, 1e-2, 0.1, 1.0};
  std::mt19937 random(3);
  std::uniform_real_distribution<double> angle(0, std::numbers::pi), size(smallest_log2, largest_log2);
  std::vector<std::vector<Covariance>> out(1000);
  for (std::vector<Covariance>& group : out)
    for (std::size_t i = 0; i < kMaxLights; ++i) {
      // Some nearly along an axis: there one variance is far below the step of the other.
      const double a = i % 4 == 0 ? std::ldexp(angle(random), -static_cast<int>(random() % 12)) : angle(random);
      const double major = std::exp2(size(random)), minor = major * kRatios[random() % kRatios.size()];
      const double c = std::cos(a), s = std::sin(a);
      group.push_back({static_cast<float>(major * c * c + minor * s * s), static_cast<float>((major - minor) * c * s),
                       static_cast<float>(major * s * s + minor * c * c)});
    }
  return out;
}

TEST(WireCovariance, RoundTripIsPositiveSemidefiniteAndCloseToTheOriginal) {
  int corrected = 0;
  // Up to 2^105 the mantissas hold every value; below 2^-120 a step is no longer much coarser than a float.
  for (const std::vector<Covariance>& group : random_covariances(-120, 105)) {
    const std::string bytes = encoded(group);
    const std::vector<Covariance> back = decoded(bytes);
    const std::vector<WireLight> wire = mantissas_in(bytes);
    ASSERT_EQ(back.size(), group.size());
    for (std::size_t i = 0; i < group.size(); ++i) {
      const auto [uu, uv, vv] = group[i];
      const WireLight nearest = nearest_mantissas(group[i]);
      SCOPED_TRACE(::testing::Message() << uu << " " << uv << " " << vv);
      ASSERT_TRUE(positive_semidefinite(wire[i].mantissa));
      ASSERT_TRUE(positive_semidefinite(back[i]));
      const double step = std::ldexp(1.0, wire[i].exponent), largest = std::max(uu, vv);
      std::array<double, 3> change{};
      for (std::size_t k = 0; k < 3; ++k) {
        // Mantissas up to 63 are exact as floats.
        ASSERT_EQ(back[i][k], std::ldexp(static_cast<float>(wire[i].mantissa[k]), wire[i].exponent));
        change[k] = static_cast<double>(back[i][k]) - group[i][k];
      }
      if (positive_semidefinite(nearest.mantissa)) {
        ASSERT_EQ(wire[i].mantissa, nearest.mantissa);
        ASSERT_EQ(wire[i].exponent, nearest.exponent);
        continue;
      }
      ++corrected;
      // A rank-one matrix of floats is indefinite by at most the rounding of its elements.
      const double float_rounding = largest * std::numeric_limits<float>::epsilon();
      ASSERT_LE(std::abs(change[1]), 0.5 * step + float_rounding);
      ASSERT_LT(std::max(change[0], change[2]), 1.5 * step + float_rounding);
      // Rounding in double.
      ASSERT_GE(smallest_eigenvalue(change[0], change[1], change[2]), -1e-14 * largest) << "a variance decreased";
      // 63 and 63.5 are the limits of mantissas rounded up and to the nearest; half of 62.5 is the least after that.
      ASSERT_LE(step, largest / 31.25 + float_rounding);
    }
  }
  EXPECT_GT(corrected, 3000);
}

TEST(WireCovariance, ThatOfFloatsBelowAndAboveTheRangeIsPositiveSemidefinite) {
  constexpr float kMost = std::numeric_limits<float>::max(), kLeast = std::numeric_limits<float>::denorm_min();
  std::vector<std::vector<Covariance>> groups = random_covariances(-152, -118);
  const std::vector<std::vector<Covariance>> large = random_covariances(95, 127);
  groups.insert(groups.end(), large.begin(), large.end());
  groups.push_back({{kMost, kMost, kMost}, {kMost, -kMost, 1}, {kLeast, kLeast, kLeast}, {0, kLeast, 3 * kLeast}});
  for (const std::vector<Covariance>& group : groups) {
    const std::string bytes = encoded(group);
    const std::vector<WireLight> wire = mantissas_in(bytes);
    const std::vector<Covariance> back = decoded(bytes);
    ASSERT_EQ(back.size(), group.size());
    for (std::size_t i = 0; i < group.size(); ++i) {
      ASSERT_TRUE(positive_semidefinite(wire[i].mantissa)) << group[i][0] << " " << group[i][1] << " " << group[i][2];
      ASSERT_TRUE(positive_semidefinite(back[i])) << group[i][0] << " " << group[i][1] << " " << group[i][2];
    }
  }
}

TEST(WireCovariance, VarianceDoesNotDecreaseWhereTheNearestMantissasAreIndefinite) {
  // The nearest are 4, 12, 35.
  const WireLight sent = mantissas_in(encoded({Covariance{4.4F, 12.4F, 35.4F}})).at(0);
  EXPECT_EQ(sent.mantissa, (Mantissas{5, 12, 36}));
  EXPECT_EQ(sent.exponent, 0);
  // 63.3 would become 64, which has a coarser step; a variance of 0.4 does not become 0.
  const WireLight coarser = mantissas_in(encoded({Covariance{0.4F, 5, 63.3F}})).at(0);
  EXPECT_EQ(coarser.mantissa, (Mantissas{1, 2, 33}));
  EXPECT_EQ(coarser.exponent, 1);
}

TEST(WireCovariance, IndefiniteInputIsSentAsTheNearestMatrixThatIsNot) {
  const std::vector<Covariance> inputs = {{1, 5, 1}, {-1, 0, -1}, {0, 0, -3}, {-2, 0, 5}};
  const std::vector<Covariance> back = decoded(encoded(inputs));
  EXPECT_EQ(back, (std::vector<Covariance>{{3, 3, 3}, {0, 0, 0}, {0, 0, 0}, {0, 0, 5}}));
  EXPECT_EQ(mantissas_in(encoded(inputs)).at(1).numbers, 0);
}

TEST(WireCovariance, IndefiniteMessageIsReadAsTheNearestMatrix) {
  // By numpy.linalg.eigh with the negative eigenvalue set to zero; the tolerances are a float's rounding.
  const Covariance c = received(std::array{4, 12, 35}, -10);
  EXPECT_NEAR(c[0] * 1024, 4.0915917, 1e-6);
  EXPECT_NEAR(c[1] * 1024, 11.9686886, 2e-6);
  EXPECT_NEAR(c[2] * 1024, 35.0107040, 4e-6);
  EXPECT_EQ(received(std::array{-5}, 0), (Covariance{}));
  EXPECT_EQ(received(std::array{-5, 0, 7}, 0), (Covariance{0, 0, 7}));
}

TEST(WireCovariance, EveryMessageIsReadAsTheNearestMatrixByBruteForce) {
  constexpr std::array kMantissas = {-63, -40, -12, -5, -1, 0, 1, 3, 4, 5, 11, 12, 35, 62, 63};
  int indefinite = 0;
  for (const int uu : kMantissas)
    for (const int uv : kMantissas)
      for (const int vv : kMantissas) {
        const Mantissas m = {uu, uv, vv};
        SCOPED_TRACE(::testing::Message() << uu << " " << uv << " " << vv);
        const Covariance c = received(m, -3);
        ASSERT_TRUE(positive_semidefinite(c));
        if (positive_semidefinite(m)) {
          for (std::size_t k = 0; k < 3; ++k) ASSERT_EQ(c[k], m[k] / 8.0);
        } else {
          ++indefinite;
          const std::array<double, 3> expected = nearest_by_search(m);
          // Elements of at most 126 have a float's rounding of 4e-6; the search finds an angle to about 1e-8.
          for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(c[k] * 8.0, expected[k], 1e-5);
        }
        // Where the step is half the smallest float, rounding makes even some matrices of mantissas indefinite.
        ASSERT_TRUE(positive_semidefinite(received(m, -150)));
      }
  EXPECT_GT(indefinite, 1000);
}

}  // namespace
}  // namespace lightwell
