// Writes pictures of a glossy plane and all that another renderer needs to render the same: mitsuba/glossy_plane.
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <fstream>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <vector>

#include "reference/glossy_plane.hpp"
#include "reference/glossy_sequence.hpp"

namespace lightwell::reference {
namespace {

/// Radiance peak exp((d.towards - 1) / width^2): smooth, so that the interpolation between pixels does not matter.
struct SoftLight {
  V3 towards;
  double width = 0.1;
  Rgb peak{};
};

const std::vector<SoftLight>& soft_lights() {
  static const std::vector<SoftLight> lights{
      {normalised({0.5, 0.8, -0.4}), 0.06, {60, 50, 40}}, {normalised({-0.7, 0.35, -0.6}), 0.05, {40, 45, 60}},
      {normalised({-0.2, 0.9, 0.3}), 0.1, {12, 12, 12}},  {normalised({0.9, 0.25, 0.5}), 0.12, {5, 9, 12}},
      {normalised({0.1, 0.3, 0.95}), 0.07, {30, 20, 10}}, {normalised({-0.9, 0.15, 0.3}), 0.15, {3, 2, 2}},
      {normalised({0.2, 0.5, -0.9}), 0.05, {25, 30, 25}},
  };
  return lights;
}

constexpr Rgb kGround{0.6, 0.6, 0.5}, kGrowth{0.3, 0.35, 0.45};  // radiance kGround + y kGrowth, plus the lights

Rgb radiance(const V3& d) {
  Rgb value{};
  for (std::size_t c = 0; c < 3; ++c) value[c] = kGround[c] + d.y * kGrowth[c];
  for (const SoftLight& light : soft_lights()) {
    const double f = std::exp((dot(d, light.towards) - 1) / (light.width * light.width));
    for (std::size_t c = 0; c < 3; ++c) value[c] += f * light.peak[c];
  }
  return value;
}

std::string text(std::initializer_list<double> values) {
  std::string line;
  for (const double v : values) {
    char number[32];
    std::snprintf(number, sizeof number, "%.17g", v);
    line += (line.empty() ? "[" : ", ") + std::string(number);
  }
  return line + "]";
}

std::string text(const V3& v) { return text({v.x, v.y, v.z}); }
std::string text(const Rgb& v) { return text({v[0], v[1], v[2]}); }

void write_floats(const std::string& path, const std::vector<double>& values) {
  const std::vector<float> floats(values.begin(), values.end());
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(floats.data()), static_cast<std::streamsize>(4 * floats.size()));
  if (!file) throw std::runtime_error("cannot write " + path);
}

/// Frames of OUT: FRAME.rgb.f32 and FRAME.coverage.f32, row-major, float32; albedo.f32; scene.json.
void write_frames(const std::string& out) {
  const Panorama env = from_function(1024, 512, radiance, 2);
  const GlossyScene matte{book_texture(1, 128), 0.25, plane_irradiance(env), nullptr, {}};
  const PinholeCamera camera{160, 120, 150, 79.5, 59.5};
  TrajectoryOptions options;
  options.frames_per_s = 1;
  const std::vector<Pose> poses = hand_held_trajectory(5, 40, options);
  write_floats(out + "/albedo.f32", matte.albedo.rgb);
  std::ofstream json(out + "/scene.json");
  json << "{\"size_m\": " << text({matte.size_m}) << ", \"texels\": " << matte.albedo.n << ", \"camera\": "
       << text({static_cast<double>(camera.width), static_cast<double>(camera.height), camera.focal_px})
       << ",\n\"ground\": " << text(kGround) << ", \"growth\": " << text(kGrowth) << ",\n\"lights\": [";
  const char* separator = "";
  for (const SoftLight& light : soft_lights()) {
    json << separator << "\n  {\"towards\": " << text(light.towards) << ", \"width\": " << text({light.width})
         << ", \"peak\": " << text(light.peak) << "}";
    separator = ",";
  }
  json << "],\n\"frames\": [";
  separator = "";
  for (const double alpha : {0.03, 0.1, 0.2}) {
    const SpecularTable table(env, {alpha, FresnelTerm::kOne});
    GlossyScene scene = matte;
    scene.specular = &table;
    for (const std::size_t k : {0, 3, 6, 10}) {  // elevations from one limit to the other
      char name[32];
      std::snprintf(name, sizeof name, "alpha%03d_%02zu", static_cast<int>(1000 * alpha + 0.5), k);
      const GlossyView view = render_view(scene, camera, poses[k], 24, 4);
      write_floats(out + "/" + name + ".rgb.f32", view.rgb);
      write_floats(out + "/" + name + ".coverage.f32", view.coverage);
      json << separator << "\n  {\"name\": \"" << name << "\", \"alpha\": " << text({alpha}) << ", \"rotation\": ["
           << text(poses[k].rotation[0]) << ", " << text(poses[k].rotation[1]) << ", " << text(poses[k].rotation[2])
           << "], \"translation\": " << text(poses[k].translation) << "}";
      separator = ",";
    }
  }
  json << "]}\n";
  if (!json.flush()) throw std::runtime_error("cannot write " + out + "/scene.json");
}

}  // namespace
}  // namespace lightwell::reference

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: glossy_frames FOLDER    an existing folder, for the frames and scene.json\n");
    return 2;
  }
  try {
    lightwell::reference::write_frames(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "glossy_frames: %s\n", error.what());
    return 1;
  }
  return 0;
}
