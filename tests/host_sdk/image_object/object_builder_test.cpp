// lightwell-object build: from pictures in a folder to a data set.
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include <lightwell/files.hpp>
#include <lightwell/image_object.hpp>

#include "host_sdk/image_object/matte_ball.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr int kLights = 5, kViews = 2;

double srgb(double x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055; }

class ObjectBuilder : public testing::Test {
 protected:
  ObjectBuilder() : ball(kLights) {
    describe();
    for (int v = 0; v < kViews; ++v) {
      for (int l = 0; l < kLights; ++l)
        write_picture("v" + std::to_string(v) + "_l" + std::to_string(l) + ".png",
                      ball.lit[static_cast<std::size_t>(l)]);
      cv::Mat mask(Ball::kSide, Ball::kSide, CV_8U);
      for (int p = 0; p < Ball::kSide * Ball::kSide; ++p) mask.data[p] = ball.coverage[static_cast<std::size_t>(p)];
      cv::imwrite(folder.path("mask" + std::to_string(v) + ".png"), mask);
    }
  }

  void describe(const std::string& more = "", const std::string& pictures = "v{view}_l{light}.png") {
    std::string positions;
    for (const Vec3f& p : ball.rig.light_positions)
      positions += (positions.empty() ? "[" : ", [") + std::to_string(p.x) + ", " + std::to_string(p.y) + ", " +
                   std::to_string(p.z) + "]";
    folder.write("object.json", R"({"turns_deg": [0, 4], "light_positions_m": [)" + positions +
                                    R"(], "camera_distance_m": 5, "half_width_m": 1, "coverage": "mask{view}.png", )" +
                                    R"("pictures": ")" + pictures + "\"" + more + "}");
  }

  /// 16 bits in sRGB.
  void write_picture(const std::string& name, const std::vector<Radiance>& picture, int side = Ball::kSide) {
    cv::Mat image(side, side, CV_16UC3);
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        const Radiance& p = picture[static_cast<std::size_t>(y * Ball::kSide + x)];
        for (int c = 0; c < 3; ++c)
          image.at<cv::Vec3w>(y, x)[c] = static_cast<std::uint16_t>(
              std::lround(65535 * srgb(std::clamp(static_cast<double>(p[2 - c]), 0.0, 1.0))));
      }
    cv::imwrite(folder.path(name), image);
  }

  struct Outcome {
    int code = -1;
    std::string text;
  };
  Outcome build(const std::string& more = "") {
    const std::string log = folder.path("log");
    const int status = std::system((std::string(LIGHTWELL_OBJECT) + " build '" + folder.path("") + "' --output '" +
                                    folder.path("out.lwio") + "' " + more + " >'" + log + "' 2>&1")
                                       .c_str());
    return {status / 256, *read_text_file(log)};
  }

  Ball ball;
  TempDir folder;
};

TEST_F(ObjectBuilder, MakesADataSetThatReproducesThePictures) {
  const Outcome done = build("--luminance-step 0.005 --highlight-step 0.005 --base-step 0.005");
  ASSERT_EQ(done.code, 0) << done.text;
  EXPECT_THAT(done.text, AllOf(HasSubstr("view 1 of 2"), HasSubstr("view 2 of 2"), HasSubstr("2 views, 5 lights")));
  const auto object = ImageObject::from_bytes(*read_text_file(folder.path("out.lwio")));
  ASSERT_TRUE(object.ok());
  EXPECT_NEAR(object->rig().turns_rad[1], 4 * std::numbers::pi / 180, 1e-6);
  EXPECT_LT(rms(relit(*object->view(0), {{ball.rig.light_positions[3], {1, 1, 1}}}), ball.lit[3]), 0.006);
  EXPECT_FALSE(std::filesystem::exists(folder.path("out.lwio.parts")));
}

TEST_F(ObjectBuilder, ListsThePicturesThatAreMissing) {
  std::filesystem::remove(folder.path("v1_l3.png"));
  std::filesystem::remove(folder.path("mask0.png"));
  const Outcome done = build();
  EXPECT_EQ(done.code, 1);
  EXPECT_THAT(done.text, AllOf(HasSubstr("2 pictures are missing"), HasSubstr("v1_l3.png"), HasSubstr("mask0.png")));
  EXPECT_FALSE(std::filesystem::exists(folder.path("out.lwio")));
}

TEST_F(ObjectBuilder, GoesOnAfterAnInterruptionAndRedoesWhatChanged) {
  // The second view's picture is damaged: the run stops there, after the first view.
  folder.write("v1_l2.png", "no picture");
  const Outcome stopped = build();
  EXPECT_EQ(stopped.code, 4);
  EXPECT_THAT(stopped.text, AllOf(HasSubstr("view 1 of 2"), HasSubstr("v1_l2.png"), HasSubstr("damaged")));
  write_picture("v1_l2.png", ball.lit[2]);
  const Outcome done = build();
  EXPECT_EQ(done.code, 0) << done.text;
  EXPECT_THAT(done.text, HasSubstr("from the run before"));
}

TEST_F(ObjectBuilder, EncodesAViewAgainWhoseOptionsChanged) {
  folder.write("v1_l2.png", "no picture");
  EXPECT_EQ(build().code, 4);
  write_picture("v1_l2.png", ball.lit[2]);
  EXPECT_THAT(build("--luminance-step 0.1").text, testing::Not(HasSubstr("from the run before")));
}

TEST_F(ObjectBuilder, RefusesPicturesOfUnequalSize) {
  write_picture("v0_l4.png", ball.lit[4], 30);
  const Outcome done = build();
  EXPECT_EQ(done.code, 4);
  EXPECT_THAT(done.text, AllOf(HasSubstr("v0_l4.png has 30 x 30 pixels"), HasSubstr("40 x 40")));
}

TEST_F(ObjectBuilder, RefusesWrongDescriptions) {
  const auto refusal = [&](const std::string& text) {
    folder.write("object.json", text);
    const Outcome done = build();
    EXPECT_EQ(done.code, 4);
    return done.text;
  };
  EXPECT_THAT(refusal("{"), HasSubstr("no JSON object"));
  EXPECT_THAT(refusal(R"({"turn": 1})"), HasSubstr("no field \"turn\""));
  EXPECT_THAT(refusal(R"({"turns_deg": []})"), HasSubstr("light_positions_m"));
  EXPECT_THAT(
      refusal(R"({"turns_deg": [], "light_positions_m": [[0, 0, 1]], "camera_distance_m": 1, "half_width_m": 1})"),
      HasSubstr("turns_rad is a list of 0"));
  EXPECT_THAT(
      refusal(R"({"turns_deg": [0], "light_positions_m": [[0, 0, 0]], "camera_distance_m": 1, "half_width_m": 1})"),
      HasSubstr("position 0 is at the object's origin"));
  describe("", "../{view}{light}");
  EXPECT_THAT(build().text, HasSubstr("inside of the folder"));
  describe("", "v{view}.png");
  EXPECT_THAT(build().text, HasSubstr("{light}"));
  std::filesystem::remove(folder.path("object.json"));
  EXPECT_THAT(build().text, HasSubstr("does not exist"));
}

}  // namespace
}  // namespace lightwell::test
