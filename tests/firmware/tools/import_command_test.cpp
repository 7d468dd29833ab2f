// lightwell-calibrate import: exit status, output and notes.
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/calibration.hpp>

#include "support/read_file.hpp"
#include "support/temp_dir.hpp"
#include "tools/lightwell_calibrate/commands.hpp"

namespace lightwell {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

// Two lenses of 190 degrees, back to back, 2 cm apart, in Kalibr's format.
constexpr const char* kPair = R"(cam0:
  camera_model: pinhole
  distortion_model: equidistant
  distortion_coeffs: [0.01, -0.002, 0.0005, -0.0001]
  intrinsics: [290.5, 290.25, 500.5, 499.75]
  resolution: [1000, 1000]
  timeshift_cam_imu: 0.0015
cam1:
  camera_model: ds
  distortion_model: none
  intrinsics: [-0.2, 0.6, 300.5, 300.25, 498.5, 501.75]
  resolution: [1000, 1000]
  T_cn_cnm1: [[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, -0.02], [0, 0, 0, 1]]
)";

struct Outcome {
  int status = -1;
  std::string out, err;
};

Outcome call(const std::vector<std::string>& words) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  Outcome o;
  o.status = calibrate::import_command(words);
  o.out = testing::internal::GetCapturedStdout();
  o.err = testing::internal::GetCapturedStderr();
  return o;
}

TEST(ImportCommand, WritesACalibrationThatTheFirmwareLoads) {
  const test::TempDir dir;
  const std::string input = dir.write("chain.yaml", kPair), output = dir.path("rig.textproto");
  const Outcome o = call({input, "--output", output});
  EXPECT_EQ(o.status, 0) << o.err;
  EXPECT_THAT(o.out, IsEmpty());
  const Result<RigParameters> rig = load_calibration(output);
  ASSERT_TRUE(rig) << rig.status().message();
  ASSERT_EQ(rig->lenses.size(), 2u);
  // The values are exact after the conversion to text and back.
  const auto& first = std::get<KannalaBrandtParameters>(rig->lenses[0].model);
  EXPECT_EQ(first.fx, 290.5);
  EXPECT_EQ(first.k4, -0.0001);
  EXPECT_EQ(std::get<DoubleSphereParameters>(rig->lenses[1].model).alpha, 0.6);
  EXPECT_EQ(rig->lenses[0].pose_cv.translation, (Vec3d{0, 0, -0.01}));
  EXPECT_EQ(rig->lenses[1].pose_cv.translation, (Vec3d{0, 0, 0.01}));
}

TEST(ImportCommand, NotesGoToStandardErrorAndIntoTheFile) {
  const test::TempDir dir;
  const std::string input = dir.write("chain.yaml", kPair), output = dir.path("rig.textproto");
  const Outcome o = call({input, "--output=" + output});
  EXPECT_THAT(o.err, AllOf(HasSubstr("cam0: max_angle_deg"), HasSubstr("timeshift_cam_imu 0.0015 s")));
  EXPECT_THAT(test::read_file(output),
              AllOf(HasSubstr("# Imported by lightwell-calibrate from " + input + " (kalibr: cam0, cam1)."),
                    HasSubstr("# cam0: timeshift_cam_imu 0.0015 s")));
}

TEST(ImportCommand, JsonListsTheImportedLenses) {
  const test::TempDir dir;
  const std::string output = dir.path("rig.textproto");
  const Outcome o = call({dir.write("chain.yaml", kPair), "--json", "--max-angle-deg", "95", "--output", output});
  EXPECT_EQ(o.status, 0) << o.err;
  EXPECT_THAT(
      o.out,
      AllOf(HasSubstr("\"kind\":\"kalibr\""),
            HasSubstr(R"({"camera":"cam0","model":"kannala_brandt","width":1000,"height":1000,"max_angle_deg":95.0)"),
            HasSubstr("\"model\":\"double_sphere\""), HasSubstr("\"notes\":[")));
}

TEST(ImportCommand, OneCameraCanBeChosenAndWrittenToStandardOutput) {
  const test::TempDir dir;
  const Outcome o = call({dir.write("chain.yaml", kPair), "--camera", "1", "--kind", "kalibr", "--output", "-"});
  EXPECT_EQ(o.status, 0) << o.err;
  const Result<RigParameters> rig = parse_calibration(o.out, "standard output");
  ASSERT_TRUE(rig) << rig.status().message();
  ASSERT_EQ(rig->lenses.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<DoubleSphereParameters>(rig->lenses[0].model));
}

TEST(ImportCommand, WrongInputHasExitStatusOneAndWritesNothing) {
  const test::TempDir dir;
  const std::string output = dir.write("rig.textproto", "what was there");
  const std::string broken = dir.write("broken.yaml", "cam0:\n  camera_model: ds\n  resolution: [0, 0]\n");
  const Outcome o = call({broken, "--output", output});
  EXPECT_EQ(o.status, 1);
  EXPECT_THAT(o.err, HasSubstr("lightwell-calibrate import: " + broken + ":3: cam0.resolution"));
  EXPECT_EQ(test::read_file(output), "what was there");
  EXPECT_EQ(call({dir.path("nothing.yaml"), "--output", output}).status, 1);
  EXPECT_THAT(call({dir.path("nothing.yaml"), "--output", output}).err, HasSubstr("there is no such file"));
  EXPECT_EQ(call({dir.path("."), "--output", output}).status, 1) << "a folder";
  EXPECT_EQ(call({dir.write("chain.yaml", kPair), "--output", dir.path("no/folder/rig.textproto")}).status, 1);
}

TEST(ImportCommand, WrongUsageHasExitStatusTwo) {
  const test::TempDir dir;
  const std::string input = dir.write("chain.yaml", kPair), output = dir.path("rig.textproto");
  const std::vector<std::vector<std::string>> wrong{
      {},
      {input},
      {"--output", output},
      {input, input, "--output", output},
      {input, "--output"},
      {input, "--output", output, "--output", output},
      {input, "--output", output, "--kind", "matlab"},
      {input, "--output", output, "--camera", "-1"},
      {input, "--output", output, "--camera", "one"},
      {input, "--output", output, "--max-angle-deg", "0"},
      {input, "--output", output, "--max-angle-deg", "181"},
      {input, "--output", output, "--max-angle-deg", "nan"},
      {input, "--output", output, "--max-angle-deg", "wide"},
      {input, "--output", output, "--camra", "1"},
      {input, "--output", "-", "--json"},
      {input, "--output", ""},
      {"", "--output", output},
  };
  for (const std::vector<std::string>& words : wrong) {
    const Outcome o = call(words);
    EXPECT_EQ(o.status, 2) << testing::PrintToString(words);
    EXPECT_THAT(o.err, HasSubstr("see --help"));
    EXPECT_THAT(o.out, IsEmpty());
  }
  EXPECT_FALSE(std::filesystem::exists(output));
}

TEST(ImportCommand, HelpNamesEveryOptionAndTheExitStatus) {
  const Outcome o = call({"--help"});
  EXPECT_EQ(o.status, 0);
  EXPECT_THAT(o.err, IsEmpty());
  for (const char* part : {"--output FILE", "--kind KIND", "--camera N", "--max-angle-deg A", "--json", "Exit status",
                           "opencv", "kalibr", "ros"})
    EXPECT_THAT(o.out, HasSubstr(part));
}

TEST(ImportCommand, NamesCannotBreakOutOfACommentOrAString) {
  const test::TempDir dir;
  const std::string info =
      "image_width: 100\nimage_height: 100\ncamera_name: \"a\\nlens { } \\\"b\\\\\"\n"
      "camera_matrix: {rows: 3, cols: 3, data: [50, 0, 49.5, 0, 50, 49.5, 0, 0, 1]}\n"
      "distortion_model: equidistant\ndistortion_coefficients: {rows: 1, cols: 4, data: [0, 0, 0, 0]}\n";
  const std::string output = dir.path("rig.textproto");
  const Outcome o = call({dir.write("info.yaml", info), "--json", "--output", output});
  ASSERT_EQ(o.status, 0) << o.err;
  EXPECT_THAT(o.out, HasSubstr(R"("camera":"a\nlens { } \"b\\")"));
  EXPECT_THAT(test::read_file(output), Not(HasSubstr("\nlens { }")));
  EXPECT_EQ(load_calibration(output)->lenses.size(), 1u);
}

}  // namespace
}  // namespace lightwell
