// The scene file but for its objects and lights.
#include "ar_viewer/scene.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>

#include "ar_viewer/scene_fields.hpp"
#include "ar_viewer/scene_objects.hpp"

namespace lightwell::viewer {
namespace {

constexpr std::size_t kMaxSceneBytes = std::size_t{1} << 20;

CameraModel read_camera(const nlohmann::json& json, Status& status) {
  CameraModel camera;
  Fields fields(json, "camera", status);
  for (const char* name : {"width", "height", "fx", "fy", "cx", "cy"}) fields.require(name);
  const Range side{CameraModel::kMinSide, CameraModel::kMaxSide}, focal{1, 1e6}, centre{-1e5, 1e5};
  fields.read("width", camera.width, side);
  fields.read("height", camera.height, side);
  fields.read("fx", camera.fx, focal);
  fields.read("fy", camera.fy, focal);
  fields.read("cx", camera.cx, centre);
  fields.read("cy", camera.cy, centre);
  fields.read("distortion", std::span<double>(camera.distortion), Range{-100, 100});
  fields.refuse_others();
  return camera;
}

TrackedTag read_tag(const nlohmann::json& json, Status& status) {
  TrackedTag tag;
  Fields fields(json, "tag", status);
  fields.require("id");
  fields.require("size_m");
  fields.read_choice("family", kTagFamilies, tag.family);
  fields.read("id", tag.id, Range{0, 65535});
  fields.read("size_m", tag.size_m, Range{1e-3, 100});
  fields.read("T_world_tag", tag.T_world_tag);
  fields.refuse_others();
  return tag;
}

Ground read_ground(const nlohmann::json& json, Status& status) {
  Ground ground;
  Fields fields(json, "ground", status);
  fields.read("T_world_plane", ground.T_world_plane);
  const Range size{1e-3, 1e3};
  if (fields.has("size_m") && json.at("size_m").is_array()) {
    std::array<double, 2> both{};
    fields.read("size_m", std::span<double>(both), size);
    ground.width_m = both[0];
    ground.depth_m = both[1];
  } else {
    fields.read("size_m", ground.width_m, size);
    ground.depth_m = ground.width_m;
  }
  fields.refuse_others();
  return ground;
}

ShadowStyle read_shadow(const nlohmann::json& json, Status& status) {
  ShadowStyle style;
  Fields fields(json, "shadow", status);
  constexpr std::array<std::string_view, 2> kDisplays = {"ratio", "alpha_test"};
  fields.read_choice("display", kDisplays, style.display);
  fields.read("strength", style.strength, kUnitRange);
  fields.read("gain", style.gain, Range{0, 10});
  fields.read("alpha_cutoff", style.alpha_cutoff, kUnitRange);
  fields.read("stale_fade_s", style.stale_fade_s, Range{0, 3600});
  fields.refuse_others();
  return style;
}

ReflectionStyle read_reflection(const nlohmann::json& json, Status& status) {
  ReflectionStyle style;
  Fields fields(json, "reflection", status);
  constexpr std::array<std::string_view, 2> kSources = {"prefiltered", "cube_map"};
  fields.read_choice("source", kSources, style.source);
  fields.read("every_frames", style.every_frames, Range{1, 1000});
  fields.read("edge", style.edge, Range{8, 64});
  if (!is_environment_edge(static_cast<std::uint64_t>(style.edge)))
    fields.fail("edge", "it is " + std::to_string(style.edge) + "; write 8, 16, 32 or 64");
  fields.read("objects_edge", style.objects_edge, Range{0, 256});
  fields.refuse_others();
  return style;
}

void read_pose(Fields& fields, Scene& scene, Status& status) {
  Pose T_world_camera;
  fields.read("T_world_camera", T_world_camera);
  scene.pose = T_world_camera;
  const nlohmann::json* tag = fields.member("tag");
  if (tag != nullptr) scene.pose = read_tag(*tag, status);
  if (fields.has("T_world_camera") == fields.has("tag"))
    fields.fail("T_world_camera", fields.has("tag") ? "tag gives the camera's pose, too; remove one of them"
                                                    : "the scene needs either T_world_camera or tag");
}

void read_fields(const nlohmann::json& json, const std::string& folder, Scene& scene, Status& status) {
  Fields fields(json, "", status);
  fields.require("camera");
  fields.require("light");
  if (const auto* camera = fields.member("camera")) scene.camera = read_camera(*camera, status);
  fields.read_path("background", folder, scene.background);
  fields.read("exposure", scene.exposure, Range{1e-12, 1e12});
  read_pose(fields, scene, status);
  if (fields.has("T_world_probe")) fields.read("T_world_probe", scene.T_world_probe.emplace());
  if (const auto* light = fields.member("light")) scene.lights["light"] = read_light(*light, "light", folder, status);
  if (const auto* sources = fields.member("sources")) {
    Fields each(*sources, "sources", status);
    for (const auto& [name, light] : sources->items())
      if (each.member(name.c_str()) != nullptr)
        scene.lights[name] = read_light(light, "sources." + name, folder, status);
    if (sources->contains("light")) each.fail("light", "the field `light` of the scene has this name; choose another");
  }
  if (const auto* ground = fields.member("ground")) scene.ground = read_ground(*ground, status);
  if (const auto* objects = fields.member("objects")) scene.objects = read_objects(*objects, folder, status);
  fields.read_choice("shading", kShadingNames, scene.shading);
  if (fields.has("side_by_side"))
    fields.read_choice("side_by_side", kShadingNames, scene.side_by_side.emplace(Shading::full));
  if (const auto* shadow = fields.member("shadow")) scene.shadow = read_shadow(*shadow, status);
  if (const auto* reflection = fields.member("reflection")) scene.reflection = read_reflection(*reflection, status);
  fields.refuse_others();
}

}  // namespace

Result<Scene> read_scene(const std::string& path) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  if (error || !file) return Status(StatusCode::not_found, path + ": the scene cannot be opened");
  if (bytes > kMaxSceneBytes)
    return Status(StatusCode::resource_exhausted,
                  path + ": larger than 1 MiB; a scene names files, it does not hold them");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  nlohmann::json json;
  try {
    json = nlohmann::json::parse(text);
  } catch (const nlohmann::json::exception& e) {
    return invalid_argument(path + ": not JSON: " + e.what());
  }
  Scene scene;
  Status status;
  read_fields(json, std::filesystem::path(path).parent_path().string(), scene, status);
  if (!status.ok()) return status.in(path);
  return scene;
}

}  // namespace lightwell::viewer
