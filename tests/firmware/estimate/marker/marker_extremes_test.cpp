// The marker's whole way, from the picture's bytes to the descriptor, where pictures are hard or are none of the
// marker: refused, flagged or right, never confidently wrong, never a number that is none.
#include <cctype>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "firmware/estimate/marker/extreme_scenes.hpp"

namespace lightwell::marker::test {
namespace {

const std::vector<ExtremeCase>& cases() {
  static const std::vector<ExtremeCase> all = extreme_cases(LIGHTWELL_MARKER_BODIES);
  return all;
}

class MarkerExtremes : public testing::TestWithParam<ExtremeCase> {};

TEST_P(MarkerExtremes, IsRefusedOrFlaggedOrRight) {
  const ExtremePicture picture(GetParam());
  for (const std::uint64_t seed : {1U, 2U}) {
    for (const Evaluation& v : picture.judged(seed)) {
      if (GetParam().unsolved) {
        EXPECT_TRUE(v.outcome != Outcome::wrong || v.why.find("beyond three deviations") != std::string::npos) << v.why;
        continue;
      }
      EXPECT_NE(v.outcome, Outcome::wrong)
          << v.why << ": off by " << v.error_deg << " deg, sigma " << v.sigma_deg << " deg, seed " << seed;
      if (GetParam().easy) {
        EXPECT_EQ(v.outcome, Outcome::right) << v.why << ": off by " << v.error_deg << " deg, sigma " << v.sigma_deg;
      }
      if (v.outcome == Outcome::refused) {
        EXPECT_GT(v.why.size(), 20U) << "a message that helps";
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Each, MarkerExtremes, testing::ValuesIn(cases()),
                         [](const testing::TestParamInfo<ExtremeCase>& one) {
                           std::string name;
                           for (const char c : one.param.name)
                             name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
                           return name;
                         });

const ExtremeCase& case_of(const std::string& name) {
  for (const ExtremeCase& one : cases())
    if (one.name == name) return one;
  throw std::runtime_error("no case " + name);
}

// Noise is another in each format, and with it what explains the picture best (a table or none): two answers may be as
// far apart as both say of themselves, and each is as good as a lamp in view has to be.
TEST(MarkerFormats, OneSceneHasOneLightWhateverThePixels) {
  constexpr double kLampInViewDeg = 3;
  const Evaluation rgb = ExtremePicture(case_of("plain")).worst(1);
  ASSERT_TRUE(rgb.direction.has_value());
  EXPECT_LT(rgb.error_deg, kLampInViewDeg);
  for (const PixelFormat format :
       {PixelFormat::nv12, PixelFormat::yuyv, PixelFormat::bayer_rggb8, PixelFormat::bayer_rggb12}) {
    const Evaluation other = ExtremePicture(case_of("plain, " + std::string(to_string(format)))).worst(1);
    ASSERT_TRUE(other.direction.has_value()) << to_string(format);
    EXPECT_LT(other.error_deg, kLampInViewDeg) << to_string(format);
    EXPECT_LT(angle_between(*rgb.direction, *other.direction) * 180 / std::numbers::pi,
              3 * std::hypot(rgb.sigma_deg, other.sigma_deg))
        << to_string(format);
  }
}

TEST(MarkerExtremesRefuse, WhatShowsNoTagOfTheBody) {
  for (const char* name : {"exposure x 1e-4, all black", "mirrored picture", "another body's tags", "noise alone",
                           "floats, none a number"}) {
    const Evaluation v = ExtremePicture(case_of(name)).worst(1);
    EXPECT_EQ(v.outcome, Outcome::refused) << name << ": " << name_of(v.outcome) << ", " << v.why;
  }
}

TEST(MarkerExtremesJudge, KnowsRightFromWrong) {
  const Vec3d truth{0, 0, 1};
  const auto answer = [](double off_deg, double sigma_deg) {
    Descriptor d;
    d.radiance.band = 1;
    Light light;
    const double off = off_deg * std::numbers::pi / 180, sigma = sigma_deg * std::numbers::pi / 180;
    light.direction = vec_cast<float>(Vec3d{std::sin(off), 0, std::cos(off)});
    light.irradiance = {1, 1, 1};
    light.direction_covariance = {static_cast<float>(sigma * sigma), 0, static_cast<float>(sigma * sigma)};
    light.track = 1;
    d.lights = {light};
    return d;
  };
  EXPECT_EQ(judge_extreme({}, answer(2, 1), truth).outcome, Outcome::right);
  EXPECT_EQ(judge_extreme({}, answer(4, 1), truth).outcome, Outcome::wrong) << "beyond three deviations";
  EXPECT_EQ(judge_extreme({}, answer(12, 8), truth).outcome, Outcome::wrong) << "too far for an answer without a flag";
  Descriptor unsure = answer(12, 1);
  unsure.flags.set(Flag::unsure);
  EXPECT_EQ(judge_extreme({}, unsure, truth).outcome, Outcome::flagged);
  Descriptor clipped = answer(4, 1);
  clipped.flags.set(Flag::clipped);
  EXPECT_EQ(judge_extreme({}, clipped, truth).outcome, Outcome::wrong) << "clipped speaks of energy, not of direction";
  Descriptor none = answer(1, 1);
  none.lights[0].irradiance.g = NAN;
  EXPECT_EQ(judge_extreme({}, none, truth).outcome, Outcome::wrong);
  none = answer(1, 1);
  none.lights.clear();
  EXPECT_EQ(judge_extreme({}, none, truth).outcome, Outcome::wrong) << "no light, and no word of it";
  EXPECT_EQ(judge_extreme(Status(StatusCode::not_found, "no tag"), {}, truth).outcome, Outcome::refused);
  EXPECT_EQ(judge_extreme(Status(StatusCode::data_loss, "?"), {}, truth).outcome, Outcome::wrong);
}

}  // namespace
}  // namespace lightwell::marker::test
