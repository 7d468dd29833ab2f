// The program for tests/measure/count_instructions: processes N frames from frame to encoded descriptor. One-time work
// (scene, tables, first frame) does not depend on N.
//   measure_instructions --frames N [RIG [FORMAT [SETTING]]]
// RIG: single, one lens of 1280x960; equirect, a whole sphere of 1568x784. FORMAT: rgb8_linear, RGB8 with linear
// response; or rgb8, nv12, yuyv, bayer8, bayer10, bayer12, rgb_f32 with the rig's response. SETTING: fast, balanced,
// exact. Defaults: single, rgb8_linear, fast.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include <lightwell/codec.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "sim/panorama.hpp"
#include "sim/render.hpp"
#include "sim/rigs.hpp"
#include "sim/sensor.hpp"

namespace {

using namespace lightwell;

/// Exposure time as in measure_speed.
constexpr double kExposure = 1e-3;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_instructions: %s\n", s.message().c_str());
  std::exit(1);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view kind = argc > 3 ? argv[3] : "single", pixels_of = argc > 4 ? argv[4] : "rgb8_linear",
                         setting_name = argc > 5 ? argv[5] : "fast";
  const bool sphere = kind == "equirect", linear = pixels_of == "rgb8_linear";
  const std::optional<PixelFormat> format = linear ? PixelFormat::rgb8 : pixel_format_of(pixels_of);
  const auto setting =
      std::find_if(kSettings.begin(), kSettings.end(), [&](Setting s) { return to_string(s) == setting_name; });
  if (argc < 3 || argc > 6 || std::strcmp(argv[1], "--frames") != 0 || (!sphere && kind != "single") || !format ||
      setting == kSettings.end())
    return std::fprintf(stderr, "usage: measure_instructions --frames N [RIG [FORMAT [SETTING]]]\n"), 2;
  const int frames = std::atoi(argv[2]);
  const Result<std::string> path = sim::scene_path("city");
  if (!path) fail(path.status());
  Result<sim::Panorama> panorama = sim::load_panorama(*path);
  if (!panorama) fail(panorama.status());
  const sim::Scene scene(std::move(*panorama));

  RigParameters rig = *sim::make_rig(kind, sphere ? 1568 : 1280, sphere ? 784 : 960, *format);
  LensParameters& lens = rig.lenses.front();
  if (linear) lens.photometry.response.kind = ResponseCurve::Kind::linear;
  const sim::Sensor sensor(lens, sim::sensor_of(rig, *format, 1));
  std::vector<std::byte> pixels(sensor.bytes());
  sensor.expose(sim::render_radiance(scene, scene.state_at(0), lens), {kExposure, 1, 0, 0}, pixels);

  PanoramaOptions options;
  options.config.setting = *setting;
  auto estimator = make_panorama_estimator(rig, options);
  if (!estimator) fail(estimator.status());
  Frame frame;
  frame.info.exposure_s = kExposure;
  frame.add_view({0, *format, lens.width, lens.height, sensor.stride(), pixels});
  Encoder encoder;
  Descriptor d;
  for (int i = 0; i < frames; ++i) {
    frame.info.sequence = static_cast<std::uint64_t>(i);
    frame.info.mid_exposure = {static_cast<std::int64_t>(i + 1) * 33'000'000};
    frame.info.delivered = frame.info.mid_exposure;
    if (const Status s = (*estimator)->estimate({&frame, 1}, d); !s.ok()) fail(s);
    if (const auto bytes = encoder.encode(d); !bytes) fail(bytes.status());
  }
  std::printf("%d frames of %dx%d, %zu lights\n", frames, lens.width, lens.height, d.lights.size());
  return 0;
}
