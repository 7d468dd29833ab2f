// lightwell-calibrate photometry: accuracy of the calibration from folders of pictures, and errors, which replace
// nothing.
#include <cmath>
#include <ctime>
#include <filesystem>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <lightwell/calibration.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/response.hpp"
#include "firmware/calibration/photometry/lamp_picture.hpp"
#include "firmware/calibration/photometry/simulated_camera.hpp"
#include "firmware/tools/plotted.hpp"
#include "imaging/image_file.hpp"
#include "sim/sensor.hpp"
#include "support/read_file.hpp"
#include "support/temp_dir.hpp"
#include "tools/lightwell_calibrate/commands.hpp"

namespace lightwell {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

constexpr int kWidth = 640, kHeight = 480;
constexpr double kNits = 100;

/// Exit status and output of the command.
struct Outcome {
  int exit = -1;
  std::string out, err;
};

Outcome run(const std::vector<std::string>& arguments) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  Outcome outcome;
  outcome.exit = calibrate::photometry_command(arguments);
  outcome.out = testing::internal::GetCapturedStdout();
  outcome.err = testing::internal::GetCapturedStderr();
  return outcome;
}

/// A rig with a fisheye lens of 190 degrees, folders with its pictures, and a calibration of its geometry alone.
class PhotometryCommand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TempDir;
    RigParameters rig = truth();
    const sim::Sensor sensor(rig.lenses[0], sim::sensor_of(rig, PixelFormat::rgb8, 1));
    write_series(sensor, "series", {0.3e-3, 0.6e-3, 1.2e-3, 2.4e-3, 4.8e-3, 9.6e-3, 19.2e-3, 38.4e-3},
                 photometry::shades);
    write_series(sensor, "dark", {0.01, 0.01, 0.01, 0.01}, [](int, int) { return 0.0; });
    write_series(sensor, "flat", {1e-3, 1e-3, 2e-3, 2e-3, 4e-3, 4e-3, 6e-3, 6e-3, 8e-3, 8e-3},
                 [](int, int) { return 100.0; });
    // A middle grey of 100 cd/m² in the centre.
    write_series(sensor, "card", {4e-3},
                 [](int x, int y) { return x > 240 && x < 400 && y > 180 && y < 300 ? kNits : 10.0; });
    photometry::LampCamera lamp(rig, PixelFormat::rgb8, 5);
    std::string list = "file,exposure_s,time_s\n", angles = "file,angle_deg\n";
    for (int i = 0; i <= 30; ++i) {
      const double degrees = i == 30 ? 88.5 : 3.0 * i;
      const std::string name = "lamp" + std::to_string(i) + ".png";
      write(fs::path("lamp") / name, lamp.bytes(degrees * std::numbers::pi / 180, 0.4, 60, 0.01));
      list += name + ",0.01," + std::to_string(i) + "\n";
      angles += name + "," + std::to_string(degrees) + "\n";
    }
    folder_->write("lamp/frames.csv", list);
    folder_->write("lamp/angles.csv", angles);

    for (LensParameters& lens : rig.lenses) lens.photometry = {};
    rig.nits_per_unit = 0;
    folder_->write("in.textproto", calibration_to_text(rig));
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  /// Strong vignetting, a white balance, and one cd/m² per unit.
  static RigParameters truth() {
    RigParameters rig = *sim::make_rig("pair", kWidth, kHeight, PixelFormat::rgb8);
    rig.lenses[0].photometry.vignetting = {-0.2, 0.03, -0.003};
    rig.lenses[0].photometry.white_balance = {1.6, 1, 1.3};
    rig.nits_per_unit = 1;
    return rig;
  }

  static void write(const fs::path& name, const std::vector<std::byte>& bytes) {
    const fs::path path = folder_->path(name.string());
    fs::create_directories(path.parent_path());
    ASSERT_TRUE(write_png(path.string(), {kWidth, kHeight, PixelFormat::rgb8, bytes}).ok());
  }

  static void write_series(const sim::Sensor& sensor, const std::string& name, const std::vector<double>& exposures,
                           const std::function<double(int, int)>& scene) {
    std::vector<float> radiance;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) radiance.insert(radiance.end(), 3, static_cast<float>(scene(x, y)));
    std::string list = "file,exposure_s,time_s\n";
    for (std::size_t i = 0; i < exposures.size(); ++i) {
      std::vector<std::byte> bytes(sensor.bytes());
      sensor.expose(radiance, {exposures[i], 1, i, 0}, bytes);
      const std::string file = std::to_string(i) + ".png";
      write(fs::path(name) / file, bytes);
      list += file + "," + std::to_string(exposures[i]) + "," + std::to_string(i) + "\n";
    }
    folder_->write(name + "/frames.csv", list);
  }

  static std::string at(const std::string& name) { return folder_->path(name); }
  static std::vector<std::string> words(std::vector<std::string> more, const std::string& output = "out.textproto") {
    std::vector<std::string> out{"--calibration", at("in.textproto"), "--output", at(output)};
    out.insert(out.end(), more.begin(), more.end());
    return out;
  }

  static test::TempDir* folder_;
};

test::TempDir* PhotometryCommand::folder_ = nullptr;

TEST_F(PhotometryCommand, MeasuresAllParametersOfACamera) {
  const Outcome done =
      run(words({"--dark", at("dark"), "--response", at("series"), "--flat", at("flat"), "--lamp", at("lamp"), "--grey",
                 at("card/0.png") + ":260,200,120,80", "--nits", "100", "--json"}));
  ASSERT_EQ(done.exit, 0) << done.err;
  const Result<RigParameters> found = load_calibration(at("out.textproto"));
  ASSERT_TRUE(found.ok()) << found.status().message();
  const PhotometricCalibration& p = found->lenses[0].photometry;
  const PhotometricCalibration wanted = truth().lenses[0].photometry;
  EXPECT_EQ(p.response.kind, ResponseCurve::Kind::srgb);
  EXPECT_NEAR(p.black_level, wanted.black_level, 0.001);
  EXPECT_NEAR(p.read_noise, wanted.read_noise, 0.05 * wanted.read_noise);
  EXPECT_NEAR(p.shot_noise, wanted.shot_noise, 0.05 * wanted.shot_noise);
  for (int degrees = 0; degrees <= 95; degrees += 5) {
    const double angle = degrees * std::numbers::pi / 180;
    // The lamp, which is not a point, was last observed at 88.5 degrees.
    EXPECT_NEAR(vignetting(p, angle) / vignetting(wanted, angle), 1, 0.01) << degrees;
  }
  for (const std::size_t c : {0U, 2U})
    EXPECT_NEAR(p.white_balance[c], wanted.white_balance[c], 0.005 * wanted.white_balance[c]);
  EXPECT_EQ(p.white_balance[1], 1);
  EXPECT_NEAR(found->nits_per_unit, 1, 0.01);
  ASSERT_TRUE(found->report);
  EXPECT_NEAR(static_cast<double>(found->report->photometry_time_s), static_cast<double>(std::time(nullptr)), 600);
  EXPECT_EQ(found->lenses.size(), 2U);
  EXPECT_EQ(found->lenses[1].photometry.read_noise, 0) << "the other lens is unchanged";

  EXPECT_THAT(done.out, HasSubstr("\"response\":{\"kind\":\"srgb\""));
  EXPECT_THAT(done.out, HasSubstr("\"scale\":{\"nits_per_unit\":"));
  const auto curves = nlohmann::json::parse(done.out)["curves"];
  EXPECT_GT(curves["response"]["points"].size(), 100U);
  EXPECT_EQ(curves["vignetting"]["points"].size(), 31U) << "one for each picture of the lamp";
  EXPECT_GT(curves["noise"]["points"].size(), 5U);
  const auto edge = curves["vignetting"]["curve"].back();
  EXPECT_NEAR(edge[1].get<double>(), vignetting(p, edge[0].get<double>() * std::numbers::pi / 180), 1e-9);
  const Result<Image> report = read_image(test::plotted(*folder_, done.out, "report.png"));
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_GT(report->width, 1000);
}

TEST_F(PhotometryCommand, StepsWithoutInputKeepTheirValuesAndLuxGivesTheScale) {
  RigParameters rig = truth();
  folder_->write("true.textproto", calibration_to_text(rig));
  const double lux = kNits * std::numbers::pi / 0.18;
  const Outcome done = run({"--calibration", at("true.textproto"), "--output", at("lux.textproto"), "--grey",
                            at("card/0.png") + ":260,200,120,80", "--lux", std::to_string(lux), "--albedo", "0.18"});
  ASSERT_EQ(done.exit, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("scale"));
  const RigParameters found = *load_calibration(at("lux.textproto"));
  EXPECT_NEAR(found.nits_per_unit, 1, 0.01);
  rig.lenses[0].photometry.white_balance = found.lenses[0].photometry.white_balance;
  rig.nits_per_unit = found.nits_per_unit;
  EXPECT_EQ(calibration_identity(found), calibration_identity(rig)) << "all other values are unchanged";
}

TEST_F(PhotometryCommand, UsesAnglesOfTheGeometryWithoutAnglesFile) {
  RigParameters rig = truth();
  rig.lenses[0].photometry.vignetting = {};
  folder_->write("flatlens.textproto", calibration_to_text(rig));
  fs::rename(at("lamp/angles.csv"), at("angles.csv"));
  const Outcome done =
      run({"--calibration", at("flatlens.textproto"), "--output", at("v.textproto"), "--lamp", at("lamp")});
  fs::rename(at("angles.csv"), at("lamp/angles.csv"));
  ASSERT_EQ(done.exit, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("nits_per_unit stays as in the input"));
  const PhotometricCalibration p = load_calibration(at("v.textproto"))->lenses[0].photometry;
  EXPECT_NEAR(vignetting(p, 1.5) / vignetting(truth().lenses[0].photometry, 1.5), 1, 0.01);
}

TEST_F(PhotometryCommand, WrongInputIsNamedAndReplacesNothing) {
  folder_->write("kept.textproto", "mine");
  const auto refused = [](const std::vector<std::string>& more) {
    const Outcome done = run(words(more, "kept.textproto"));
    EXPECT_EQ(done.exit, 1) << done.err;
    EXPECT_EQ(test::read_file(at("kept.textproto")), "mine");
    return done.err;
  };
  EXPECT_THAT(refused({"--dark", at("nowhere")}), HasSubstr("nowhere/frames.csv: not there"));
  EXPECT_THAT(refused({"--response", at("dark")}), HasSubstr("1 different exposures"));
  EXPECT_THAT(refused({"--dark", at("flat")}), HasSubstr("cover the lens"));
  EXPECT_THAT(refused({"--flat", at("series")}), HasSubstr("flats come in pairs"));
  EXPECT_THAT(refused({"--lamp", at("flat")}), HasSubstr("no lamp stands out"));
  EXPECT_THAT(refused({"--grey", at("card/0.png") + ":600,200,120,80"}), HasSubstr("outside the picture"));
  EXPECT_THAT(refused({"--dark", at("dark"), "--lens", "2"}), HasSubstr("--lens 2"));
  fs::create_directories(at("small"));
  ASSERT_TRUE(write_png(at("small/0.png"), {16, 16, PixelFormat::rgb8, std::vector<std::byte>(768)}).ok());
  folder_->write("small/frames.csv", "file,exposure_s,time_s\n0.png,0.01,0\n");
  EXPECT_THAT(refused({"--dark", at("small")}), HasSubstr("16x16 pixels, the calibration of lens 0 is for 640x480"));
  fs::copy(at("card/0.png"), at("alone.png"));
  EXPECT_THAT(refused({"--grey", at("alone.png") + ":260,200,120,80", "--nits", "5"}), HasSubstr("--grey-exposure-s"));
  fs::create_directories(at("turned"));
  fs::copy(at("card/0.png"), at("turned/0.png"));
  folder_->write("turned/frames.csv", "file,exposure_s,time_s\n0.png,0.01,0\n");
  folder_->write("turned/angles.csv", "file,angle_deg\n0.png,200\n");
  EXPECT_THAT(refused({"--lamp", at("turned")}), HasSubstr("angles.csv:2: angle_deg '200'"));

  const Outcome nowhere =
      run({"--calibration", at("in.textproto"), "--output", at("no/out.textproto"), "--dark", at("dark")});
  EXPECT_EQ(nowhere.exit, 1);
  EXPECT_THAT(nowhere.err, HasSubstr("no/out.textproto: cannot"));
  for (const auto& entry : fs::directory_iterator(at(".")))
    EXPECT_FALSE(entry.path().filename().string().starts_with("kept.textproto.")) << "a temporary file was left";
}

TEST_F(PhotometryCommand, ExitStatusOfWrongUsageAndHelp) {
  EXPECT_EQ(run({"--help"}).exit, 0);
  EXPECT_THAT(run({"--help"}).out, HasSubstr("angles.csv"));
  EXPECT_EQ(run({}).exit, 2);
  EXPECT_EQ(run(words({})).exit, 2);
  EXPECT_EQ(run(words({"--drak", at("dark")})).exit, 2);
  EXPECT_EQ(run(words({"--grey", at("card/0.png")})).exit, 2);
  EXPECT_EQ(run(words({"--grey", at("card/0.png") + ":1,2,3"})).exit, 2);
  EXPECT_EQ(run(words({"--dark", at("dark"), "--nits", "5"})).exit, 2);
  const std::string grey = at("card/0.png") + ":260,200,120,80";
  EXPECT_EQ(run(words({"--grey", grey, "--nits", "5", "--lux", "5", "--albedo", "0.2"})).exit, 2);
  EXPECT_EQ(run(words({"--grey", grey, "--lux", "5"})).exit, 2);
  EXPECT_EQ(run(words({"--grey", grey, "--grey-xy", "0.3"})).exit, 2);
  EXPECT_EQ(run(words({"--dark", at("dark"), "--bits", "99"})).exit, 2);
}

}  // namespace
}  // namespace lightwell
