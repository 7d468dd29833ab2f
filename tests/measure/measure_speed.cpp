// Times the panorama estimator beside memcpy: one case from the command line, or all that tests/figures asks for.
#include <cstdio>
#include <cstring>
#include <map>

#include "measure/speed_bench.hpp"
#include "sim/panorama.hpp"

namespace {

using namespace lightwell;

void print(const std::string& name, const measure::Speed& s) {
  std::printf("{\"figure\": \"%s\", \"value\": %.4g, \"ms\": %.4g, \"memcpy_gb_per_s\": %.3g, \"bytes\": %.0f, \"lights\": %d}\n",
              name.c_str(), s.seconds / s.memcpy_seconds, s.seconds * 1e3, s.bytes / s.memcpy_seconds * 1e-9,
              s.descriptor_bytes, s.lights);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const Result<std::string> path = sim::scene_path(argc > 1 ? argv[1] : "city");
  if (!path) return std::fprintf(stderr, "%s\n", path.status().message().c_str()), 1;
  Result<sim::Panorama> panorama = sim::load_panorama(*path);
  if (!panorama) return std::fprintf(stderr, "%s\n", panorama.status().message().c_str()), 1;
  const sim::Scene scene(std::move(*panorama));
  for (const Setting setting : {Setting::fast, Setting::balanced, Setting::exact}) {
    for (const char* rig : {"equirect", "pair"}) {
      measure::SpeedCase c;
      c.rig = rig;
      // An equirectangular picture is twice as wide as high: this one has as many pixels as 1280x960.
      c.width = std::strcmp(rig, "equirect") == 0 ? 1568 : 1280;
      c.height = std::strcmp(rig, "equirect") == 0 ? 784 : 960;
      c.config.setting = setting;
      const std::string prefix = std::string(to_string(setting)) + "." + rig + ".";
      c.linear = true;
      print(prefix + "rgb8_linear", measure_speed(scene, c));
      c.linear = false;
      for (const PixelFormat format : {PixelFormat::rgb8, PixelFormat::bayer_rggb8, PixelFormat::nv12, PixelFormat::yuyv}) {
        c.format = format;
        print(prefix + std::string(to_string(format)), measure_speed(scene, c));
      }
    }
  }
  return 0;
}
