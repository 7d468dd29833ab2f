// Tests of LampFinder: the measured light depends on the position only by vignetting.
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/response.hpp"
#include "calibration/solve/photometry/vignetting.hpp"
#include "firmware/calibration/photometry/lamp_picture.hpp"
#include "sim/sensor.hpp"

namespace lightwell::photometry {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;

class Lamp : public testing::TestWithParam<PixelFormat> {
 protected:
  RigParameters rig_ = *sim::make_rig("single", 320, 240, GetParam());
  LensParameters lens_ = rig_.lenses.front();
  LampCamera camera_{rig_, GetParam(), 31};
};

TEST_P(Lamp, MeasuresTheVignetting) {
  const auto finder = LampFinder::make(lens_);
  ASSERT_TRUE(finder.ok());
  double on_axis = 0;
  for (const double degrees : {2.0, 30.0, 60.0, 80.0, 85.0}) {
    const auto seen = finder->find(camera_.shoot(degrees * kDegree, 0.3, 0.6, 0.01), 0.01, std::nullopt, "lamp");
    ASSERT_TRUE(seen.ok()) << degrees << ": " << seen.status().message();
    // A tenth of a pixel, degrees.
    EXPECT_NEAR(seen->angle_rad / kDegree, degrees, 0.15);
    if (on_axis == 0) on_axis = seen->value / vignetting(lens_.photometry, seen->angle_rad);
    // The lamp has a diameter of seven pixels; a mosaic samples each colour at every fourth photosite only.
    const double tolerance = GetParam() == PixelFormat::rgb8 ? 0.01 : 0.03;
    EXPECT_NEAR(seen->value / on_axis / vignetting(lens_.photometry, degrees * kDegree), 1, tolerance) << degrees;
    EXPECT_LT(seen->deviation, 0.01 * seen->value);
  }
  const auto told = finder->find(camera_.shoot(0.5, 0.3, 0.6, 0.01), 0.01, 0.52, "lamp");
  ASSERT_TRUE(told.ok()) << told.status().message();
  EXPECT_EQ(told->angle_rad, 0.52) << "a given angle must be used";
}

TEST_P(Lamp, IsRefusedWhereItCannotBeMeasured) {
  const auto finder = LampFinder::make(lens_);
  ASSERT_TRUE(finder.ok());
  const auto refused = [&](const Picture& picture) {
    const auto found = finder->find(picture, 0.01, std::nullopt, "lamp.png");
    EXPECT_FALSE(found.ok());
    EXPECT_THAT(found.status().message(), HasSubstr("lamp.png: "));
    return found.status().message();
  };
  EXPECT_THAT(refused(camera_.shoot(0.5, 0.3, 0, 0.01)), HasSubstr("no lamp stands out"));
  EXPECT_THAT(refused(camera_.shoot(0.5, 0.3, 5, 0.01)), HasSubstr("saturated"));
  EXPECT_THAT(refused(camera_.shoot(94.5 * kDegree, 0.3, 0.6, 0.01)), HasSubstr("cut by the edge"));
  LampCamera wide(rig_, GetParam(), 31, 15 * kDegree);
  EXPECT_THAT(refused(wide.shoot(0.5, 0.3, 0.6, 0.01)), HasSubstr("less than a tenth"));
}

INSTANTIATE_TEST_SUITE_P(Formats, Lamp, testing::Values(PixelFormat::rgb8, PixelFormat::bayer_rggb12),
                         [](const auto& tested) { return std::string(to_string(tested.param)); });

}  // namespace
}  // namespace lightwell::photometry
