#include "measure/viewer_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <span>

#include <nlohmann/json.hpp>

#include <lightwell/codec.hpp>
#include <lightwell/color.hpp>
#include <lightwell/environment.hpp>
#include <lightwell/harmonics.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/quantile.hpp>
#include <lightwell/recording.hpp>

#include "bench/alhakamy2019.hpp"

namespace lightwell::measure {
namespace {

using nlohmann::ordered_json;

/// Of the 8-bit picture for Algorithm 1: the median luminance is mid-grey.
constexpr double kMedianGrey = 0.18;

ordered_json array_of(const Vec3d& v) { return {v.x, v.y, v.z}; }
ordered_json array_of(const Quat& q) { return {q.x, q.y, q.z, q.w}; }
ordered_json array_of(Irradiance e) { return {e.r, e.g, e.b}; }
ordered_json pose_of(const Pose& pose) {
  return {{"position", array_of(pose.translation)}, {"rotation", array_of(pose.rotation)}};
}

std::uint8_t to_srgb(double v) {
  return static_cast<std::uint8_t>(255 * linear_to_srgb(std::clamp(v, 0.0, 1.0)) + 0.5);
}

/// The picture of a 360° camera with automatic exposure.
std::vector<std::uint8_t> exposed(const ColorPicture& panorama) {
  std::vector<double> luminances;
  for (const auto& c : panorama.values) luminances.push_back(static_cast<double>(luminance_of(c[0], c[1], c[2])));
  const double gain = kMedianGrey / lower_quantile(luminances, 0.5);
  std::vector<std::uint8_t> out;
  for (const auto& c : panorama.values)
    for (const float v : c) out.push_back(to_srgb(gain * static_cast<double>(v)));
  return out;
}

ordered_json mean_radiance(const Lighting& light) {
  // Of a sphere: the irradiances of opposite normals sum up to 2 pi times it, the bands 1 of both cancel.
  Irradiance sum;
  for (const Vec3f n :
       {Vec3f{1, 0, 0}, Vec3f{-1, 0, 0}, Vec3f{0, 1, 0}, Vec3f{0, -1, 0}, Vec3f{0, 0, 1}, Vec3f{0, 0, -1}})
    sum += light.irradiance(n).value;
  return array_of(sum * (1 / (6 * std::numbers::pi_v<float>)));
}

ordered_json algorithm_1(const ViewerScene& scene) {
  const std::vector<std::uint8_t> picture = exposed(scene.panorama);
  const bench::AlhakamyResult found = bench::alhakamy_detect(
      {scene.panorama.width, scene.panorama.height, picture, 3 * static_cast<std::size_t>(scene.panorama.width)});
  const Irradiance table = scene.light.irradiance({0, 1, 0}).value;
  constexpr float kPi = std::numbers::pi_v<float>;
  if (found.lights.empty()) return {{"constant", array_of(table * (1 / kPi))}};
  const bench::AlhakamyLight& main = found.lights.front();
  const Vec3d d{main.direction[0], main.direction[1], main.direction[2]};
  const double share = d.y > 0 ? main.shadow_strength : 0;
  ordered_json light = {{"direction", array_of(d)},
                        {"irradiance", array_of(table * static_cast<float>(share / std::max(d.y, 0.05)))}};
  return {{"constant", array_of(table * static_cast<float>((1 - share) / static_cast<double>(kPi)))},
          {"lights", ordered_json::array({light})}};
}

Status written(const std::string& path, std::string_view content) {
  std::ofstream file(path, std::ios::binary);
  file.write(content.data(), static_cast<std::streamsize>(content.size()));
  if (!file.flush()) return {StatusCode::unavailable, path + " cannot be written"};
  return {};
}

/// Another map of the same size: the texels of each level move on by one.
void renew_texels(EnvironmentMap& map) {
  auto first = map.texels.begin();
  for (const EnvironmentLevel& level : map.levels) {
    const auto last = first + static_cast<std::ptrdiff_t>(texel_count(std::span(&level, 1)));
    std::rotate(first, first + 1, last);
    first = last;
  }
  map.key = environment_key(map);
}

}  // namespace

std::string viewer_scene_name(const std::string& folder, const ViewerTrial& trial, const std::string& place,
                              std::string_view method) {
  return folder + "/" + trial.name + "_" + place + "_" + std::string(method);
}

Status write_viewer_scenes(const ViewerScene& scene, const std::string& folder) {
  const TrialSetup& s = scene.setup;
  const std::string descriptor = scene.trial.name + "_" + scene.place + ".descriptor";
  const std::string_view bytes(reinterpret_cast<const char*>(scene.message.data()), scene.message.size());
  if (Status w = written(folder + "/" + descriptor, bytes); !w.ok()) return w;
  for (const std::string_view method : kViewerMethods) {
    ordered_json out = {
        {"camera", {{"width", s.width}, {"height", s.height}, {"fx", s.fx}, {"fy", s.fy}, {"cx", s.cx}, {"cy", s.cy}}},
        {"background", std::filesystem::absolute(s.folder + "/" + scene.trial.name + "_without.jpg").string()},
        {"exposure", scene.trial.gain},
        {"T_world_camera", pose_of(s.T_world_camera)},
        {"T_world_probe", pose_of(scene.T_world_probe)},
        {"ground", {{"size_m", 2 * shadow_reach_m(scene.trial.shadow_m)}}},
        {"objects",
         {{{"mesh", "cylinder"},
           {"size_m", {2 * s.object_radius_m, s.object_height_m, 2 * s.object_radius_m}},
           {"material", {{"preset", "matte"}, {"base_color", s.object_albedo}}}}}}};
    out["light"] = method == "constant" ? ordered_json{{"constant", mean_radiance(scene.light)}}
                   : method == "s0"     ? algorithm_1(scene)
                                        : ordered_json(descriptor);
    out["shading"] = method == "s0" ? "full" : method;
    const std::string path = viewer_scene_name(folder, scene.trial, scene.place, method) + ".json";
    if (Status w = written(path, out.dump(1) + "\n"); !w.ok()) return w;
  }
  return {};
}

Status write_turning_light(Descriptor descriptor, int frames, const std::string& folder) {
  constexpr double kStep_rad = 0.1 * std::numbers::pi / 180;
  constexpr std::int64_t kInterval_ns = 16'000'000;
  std::filesystem::remove(folder + "/turning.lwrec");  // The writer would continue it.
  Result<RecordWriter> writer =
      RecordWriter::open(folder + "/turning.lwrec", {RecordingKind::descriptors, "measured", "0", {}});
  if (!writer) return writer.status();
  Encoder encoder;
  const Quat step = Quat::about({0, 1, 0}, kStep_rad);
  for (int i = 0; i < frames; ++i) {
    const auto bytes = encoder.encode(descriptor);
    if (!bytes) return bytes.status();
    if (Status s = writer->append(descriptor.time.mid_exposure.ns, *bytes); !s.ok()) return s;
    ++descriptor.sequence;
    descriptor.time.mid_exposure.ns += kInterval_ns;
    if (descriptor.environment) renew_texels(*descriptor.environment);
    descriptor.radiance = rotated(descriptor.radiance, step);
    for (Light& light : descriptor.lights) light.direction = normalized(rotate(step, light.direction));
  }
  return writer->flush();
}

}  // namespace lightwell::measure
