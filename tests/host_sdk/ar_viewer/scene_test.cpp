// The scene file and the program.
#include "ar_viewer/scene.hpp"

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ar_viewer/picture.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::string kCamera = R"("camera": {"width": 64, "height": 36, "fx": 50, "fy": 50, "cx": 31.5, "cy": 17.5}, )"
                            R"("T_world_camera": {"position": [0, 0.2, 0.5]}, )";
const std::string kLight = R"("light": {"constant": [0.5, 0.5, 0.5]})";

class SceneFile : public testing::Test {
 protected:
  std::string write(const std::string& text) {
    const std::string path = folder.path("scene.json");
    std::ofstream(path) << text;
    return path;
  }
  std::string error_of(const std::string& text) {
    const auto scene = viewer::read_scene(write(text));
    return scene.ok() ? std::string("accepted") : std::string(scene.status().message());
  }

  TempDir folder;
};

TEST_F(SceneFile, HasTheValuesOfItsFields) {
  folder.write("b.png", "");
  folder.write("a.lwr", "");
  const auto scene = viewer::read_scene(
      write("{" + kCamera + R"("exposure": 0.25, "background": "b.png", "T_world_probe": {"rotation": [0, 0, 2, 0]},
      "light": {"harmonics": [[1, 2, 3], [0, 0, 0], [4, 5, 6], [0, 0, 0]],
                "lights": [{"direction": [0, 2, 0], "irradiance": [7, 8, 9], "angular_radius_deg": 90,
                            "distance_m": 2}]},
      "sources": {"probe": "grpc://host", "file": "a.lwr"},
      "ground": {"size_m": [2, 3]}, "shading": "constant", "side_by_side": "off",
      "shadow": {"strength": 0.5, "gain": 2, "stale_fade_s": 1, "display": "alpha_test", "alpha_cutoff": 0.25},
      "reflection": {"source": "cube_map", "every_frames": 5, "edge": 32, "objects_edge": 0},
      "objects": [{"mesh": "box", "size_m": [1, 2, 3], "anchor": "marker_body",
                   "T_body_object": {"position": [1, 2, 3]},
                   "material": {"preset": "glass", "ior": 1.33, "lighting": "vertex"}}]})"));
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  EXPECT_EQ(scene->exposure, 0.25F);
  EXPECT_EQ(scene->background, folder.path("b.png"));
  EXPECT_EQ(scene->T_world_probe->rotation, (Quat{0, 0, 1, 0})) << "normalised";
  const auto& light = std::get<viewer::LightValues>(scene->lights.at("light")).descriptor;
  EXPECT_EQ(light.radiance.band, 1);
  EXPECT_EQ(light.radiance.c[2].g, 5);
  EXPECT_EQ(light.lights.at(0).direction, (Vec3f{0, 1, 0}));
  EXPECT_FLOAT_EQ(light.lights[0].angular_radius_rad, 1.5707964F);
  EXPECT_EQ(light.lights[0].distance_m, 2);
  EXPECT_EQ(std::get<viewer::LightUri>(scene->lights.at("probe")).uri, "grpc://host");
  EXPECT_EQ(std::get<viewer::LightFile>(scene->lights.at("file")).path, folder.path("a.lwr"));
  EXPECT_EQ(scene->ground->depth_m, 3);
  EXPECT_EQ(scene->shading, viewer::Shading::constant);
  EXPECT_EQ(scene->side_by_side, viewer::Shading::off);
  EXPECT_EQ(scene->shadow.display, viewer::ShadowDisplay::alpha_test);
  EXPECT_EQ(scene->shadow.alpha_cutoff, 0.25F);
  EXPECT_EQ(scene->reflection.source, viewer::ReflectionSource::cube_map);
  EXPECT_EQ(scene->reflection.every_frames, 5);
  const viewer::Object& object = scene->objects.at(0);
  EXPECT_EQ(object.anchor, viewer::Anchor::marker_body);
  EXPECT_EQ(object.T_anchor_object.translation, (Vec3d{1, 2, 3}));
  EXPECT_EQ(object.material.ior, 1.33F);
  EXPECT_EQ(object.material.refraction, 1.0F) << "of the preset";
  EXPECT_EQ(object.material.lighting, viewer::LightingRate::vertex);
}

TEST_F(SceneFile, ThatIsWrongIsRefusedWithFileFieldAndRemedy) {
  const std::string good = "{" + kCamera + kLight + "}";
  EXPECT_EQ(error_of(good), "accepted");
  EXPECT_THAT(error_of("{"), AllOf(HasSubstr("scene.json"), HasSubstr("not JSON")));
  EXPECT_THAT(error_of("[]"), HasSubstr("scene.json: the scene: it is []; write an object"));
  EXPECT_THAT(error_of("{" + kLight + R"(, "T_world_camera": {}})"), AllOf(HasSubstr("camera"), HasSubstr("missing")));
  EXPECT_THAT(error_of("{" + kCamera + R"("light": 3})"), AllOf(HasSubstr("light"), HasSubstr("object")));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "shadows": {}})"),
              AllOf(HasSubstr("scene.json: field shadows: "), HasSubstr("not known"), HasSubstr("shadow,")));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "shadow": {"strength": 2}})"),
              HasSubstr("scene.json: field shadow.strength: it is 2; write a number from 0 to 1"));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "shading": "best"})"),
              AllOf(HasSubstr("shading"), HasSubstr("main_light_and_sh9")));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "objects": [{}, {"material": "wood"}]})"),
              AllOf(HasSubstr("objects[1].material"), HasSubstr("plastic")));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "objects": [{"material": {"rough": 1}}]})"),
              AllOf(HasSubstr("objects[0].material.rough"), HasSubstr("roughness")));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "reflection": {"edge": 48}})"), HasSubstr("reflection.edge"));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "exposure": "1"})"),
              HasSubstr("scene.json: field exposure: it is \"1\"; write a number from "));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "objects": [{"size_m": [1, 2, 0]}]})"),
              HasSubstr("scene.json: field objects[0].size_m[2]: it is 0; write a number from 0.0001 to 1000"));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "objects": [{"mesh": "none.glb"}]})"),
              AllOf(HasSubstr("scene.json: field objects[0].mesh: there is no "), HasSubstr("none.glb; name ")));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "sources": {"old": "none.lwr"}})"),
              HasSubstr("scene.json: field sources.old: there is no "));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "shadow": {"gain": ")" + std::string(90, 'x') + R"("}})"),
              AllOf(HasSubstr("it is \"" + std::string(39, 'x') + "...;"), Not(HasSubstr(std::string(40, 'x')))));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "exposure": 1e400})"), HasSubstr("scene.json"));
  EXPECT_THAT(error_of("{" + kCamera + R"("light": {"harmonics": [[1,1,1],[1,1,1]]}})"), HasSubstr("light.harmonics"));
  EXPECT_THAT(error_of("{" + kCamera + R"("light": {"lights": [{"direction": [0,0,0], "irradiance": [1,1,1]}]}})"),
              AllOf(HasSubstr("light.lights[0].direction"), HasSubstr("zero")));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "tag": {"id": 1, "size_m": 0.1}})"),
              HasSubstr("remove one of them"));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "tag": {"id": 1, "size_m": 0.1, "family": "tag9h1"}})"),
              AllOf(HasSubstr("tag.family"), HasSubstr("tag25h9")));
  EXPECT_THAT(error_of("{" + kCamera + kLight + R"(, "T_world_probe": {"rotation": [0, 0, 0, 0]}})"),
              AllOf(HasSubstr("T_world_probe.rotation"), HasSubstr("zero")));
  EXPECT_THAT(std::string(viewer::read_scene(folder.path("none.json")).status().message()), HasSubstr("none.json"));
}

/// Exit code and output of the program.
struct Exit {
  int code = 0;
  std::string output;
};
Exit run(const std::string& arguments) {
  Exit result;
  const std::string command = std::string(LIGHTWELL_AR_VIEWER) + " " + arguments + " 2>&1";
  std::FILE* pipe = ::popen(command.c_str(), "r");
  std::array<char, 512> buffer{};
  while (std::fgets(buffer.data(), static_cast<int>(buffer.size()), pipe) != nullptr) result.output += buffer.data();
  result.code = ::pclose(pipe) >> 8;
  return result;
}

TEST_F(SceneFile, IsDrawnByTheProgram) {
  const std::string path = write("{" + kCamera + kLight + R"(, "ground": {}, "objects": [{}]})");
  const Exit done = run(path + " --headless --frames 2 --linear --json --out " + folder.path("out"));
  EXPECT_EQ(done.code, 0) << done.output;
  EXPECT_THAT(done.output, AllOf(HasSubstr("\"frame\":1"), HasSubstr("sdk_ms"), HasSubstr("\"validity\":\"valid\"")));
  for (const char* file : {"frame_0000.png", "frame_0001.png", "frame_0001.exr", "shadow_0001.exr"})
    EXPECT_TRUE(std::filesystem::exists(folder.path("out") + "/" + file)) << file;
  const auto linear = viewer::read_exr(folder.path("out") + "/frame_0001.exr");
  const auto shown = viewer::read_bytes(folder.path("out") + "/frame_0001.png");
  ASSERT_TRUE(linear.ok() && shown.ok());
  EXPECT_EQ(linear->width, 64);
  EXPECT_EQ(viewer::srgb_code(linear->at(32, 30)[0]), shown->rgb[3 * (30 * 64 + 32)]);
}

TEST_F(SceneFile, ThatTheProgramCannotDrawEndsWithItsReason) {
  const std::string missing = write("{" + kCamera + R"("background": "none.png", )" + kLight + "}");
  const Exit no_background = run(missing + " --headless --out " + folder.path("out"));
  EXPECT_EQ(no_background.code, 4);
  EXPECT_THAT(no_background.output, AllOf(HasSubstr("scene.json: field background: "), HasSubstr("none.png")));
  const std::string good = write("{" + kCamera + kLight + "}");
  const Exit no_source = run(good + " --headless --source moon --out " + folder.path("out"));
  EXPECT_EQ(no_source.code, 4);
  EXPECT_THAT(no_source.output, AllOf(HasSubstr("moon"), HasSubstr("light")));
  EXPECT_FALSE(std::filesystem::exists(folder.path("out"))) << "what failed leaves no folder";
  EXPECT_EQ(run(good + " --headless --frames 0").code, 2);
  EXPECT_EQ(run(good + " --linear").code, 2) << "without --headless";
  EXPECT_EQ(run("--help").code, 0);
}

}  // namespace
}  // namespace lightwell::test
