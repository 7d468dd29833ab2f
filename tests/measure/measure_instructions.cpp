// The program for tests/measure/count_instructions: processes N frames from frame to encoded descriptor. One-time work
// (scene, tables, first frame) does not depend on N.
//   measure_instructions --frames N [--map EDGE] [--interleave N] [--exposures N] [RIG [FORMAT [SETTING]]]
//   measure_instructions --frames N plane
// RIG: single, one lens of 1280x960; small, one of 640x480; equirect, a whole sphere of 1568x784; plane, the capture of
// a glossy plane's surface light field from 640x480 sRGB frames, at most kPlaneFrames, without descriptors. FORMAT:
// rgb8_linear, RGB8 with linear response; or rgb8, nv12, yuyv, bayer8, bayer10, bayer12, rgb_f32 with the rig's
// response. SETTING: fastest, fast, balanced, exact. Defaults: single, rgb8_linear, fast. --map: with a map of this
// edge in every frame.
// --interleave: panorama.interleave. --exposures: of a bracket, which then counts as one frame.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>

#include <lightwell/codec.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "estimate/specular/plane_capture.hpp"
#include "measure/specular_sequences.hpp"
#include "sim/panorama.hpp"
#include "sim/scene.hpp"
#include "sim/sensor.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;

/// More than the frames per second: with --map, a map is due in every frame.
constexpr double kMapRate_hz = 60;
/// Exposure time as in measure_speed.
constexpr double kExposure = 1e-3, kExposureRatio = 16;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_instructions: %s\n", s.message().c_str());
  std::exit(1);
}

/// Rendered whatever the number of frames that are captured.
constexpr int kPlaneFrames = 40;

/// Captures the first frames of a sequence.
int capture_plane(int frames) {
  measure::SpecularSequenceOptions options;
  options.name = "lamps";
  const auto made = measure::SpecularSequence::make(options);
  if (!made) fail(made.status());
  const measure::SpecularSequence& sequence = **made;
  std::vector<measure::Shot> shots;
  for (int k = 0; k < kPlaneFrames; ++k) shots.push_back(sequence.frame(k));
  estimate::RowReader reader(sequence.rig());
  specular::PlaneCapture capture(sequence.rig(), {});
  int stored = 0;
  for (int k = 0; k < frames; ++k) {
    if (const Status s = reader.bind(shots[static_cast<std::size_t>(k)].frames); !s.ok()) fail(s);
    stored +=
        capture
            .add(reader, 0, sequence.tag_pose(k), static_cast<std::uint32_t>(k), measure::SpecularSequence::kExposure_s)
            .stored;
  }
  std::printf("%d frames of %dx%d, %d stored\n", frames, options.width, options.height, stored);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Processes N frames from frame to encoded descriptor.", "measure_instructions"};
  int frames = 0, exposures = 1;
  std::string kind = "single", pixels_of = "rgb8_linear";
  PanoramaOptions options;
  options.config.setting = Setting::fast;
  app.add_option("--frames", frames, "Number of frames")->required()->check(CLI::NonNegativeNumber);
  app.add_option("RIG", kind,
                 "single: one lens of 1280x960; small: one of 640x480; equirect: a whole sphere of 1568x784; plane: "
                 "capture of a glossy plane "
                 "from 640x480 sRGB frames, at most 40 [single]")
      ->check(CLI::IsMember({"single", "small", "equirect", "plane"}));
  app.add_option("FORMAT", pixels_of,
                 "rgb8_linear: RGB8 with linear response; or rgb8, nv12, yuyv, bayer8, bayer10, bayer12, rgb_f32 with "
                 "the rig's response [rgb8_linear]");
  add_named_option(app, "SETTING", options.config.setting, kSettings, "fastest, fast, balanced or exact [fast]");
  app.add_option("--map", options.config.panorama.environment_edge, "Edge of a map in every frame [none]")
      ->check(CLI::IsMember({8, 16, 32, 64}));
  app.add_option("--exposures", exposures, "Exposures of a bracket, each 16 times as long as the one before [1]")
      ->check(CLI::Range(1, 3));
  app.add_option("--interleave", options.config.panorama.interleave, "Frames that read the picture once [1]")
      ->check(CLI::Range(1, 16));
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  options.config.panorama.environment_rate = kMapRate_hz;
  if (kind == "plane")
    return frames <= kPlaneFrames ? capture_plane(frames) : wrong_usage(app, "plane: at most 40 frames");
  const bool sphere = kind == "equirect", small = kind == "small", linear = pixels_of == "rgb8_linear";
  const std::optional<PixelFormat> format = linear ? PixelFormat::rgb8 : pixel_format_of(pixels_of);
  if (!format) return wrong_usage(app, "unknown FORMAT '" + pixels_of + "'");
  const Result<std::string> path = sim::scene_path("city");
  if (!path) fail(path.status());
  Result<sim::Panorama> panorama = sim::load_panorama(*path);
  if (!panorama) fail(panorama.status());
  const sim::Scene scene(std::move(*panorama));

  const int width = sphere ? 1568 : small ? 640 : 1280, height = sphere ? 784 : width / 4 * 3;
  RigParameters rig = *sim::make_rig(sphere ? "equirect" : "single", width, height, *format);
  LensParameters& lens = rig.lenses.front();
  if (linear) lens.photometry.response.kind = ResponseCurve::Kind::linear;
  const sim::Sensor sensor(lens, sim::sensor_of(rig, *format, 1));
  const std::vector<float> radiance = sim::render_radiance(scene, scene.state_at(0), lens);
  // The shortest exposure is that of a single frame.
  std::vector<std::vector<std::byte>> pixels(static_cast<std::size_t>(exposures),
                                             std::vector<std::byte>(sensor.bytes()));
  std::vector<Frame> bracket(pixels.size());
  for (std::size_t e = 0; e < bracket.size(); ++e) {
    bracket[e].info.exposure_s = kExposure * std::pow(kExposureRatio, e);
    sensor.expose(radiance, {bracket[e].info.exposure_s, 1, e, 0}, pixels[e]);
    bracket[e].add_view({0, *format, lens.width, lens.height, sensor.stride(), pixels[e]});
  }

  auto estimator = make_panorama_estimator(rig, options);
  if (!estimator) fail(estimator.status());
  Encoder encoder;
  Descriptor d;
  for (int i = 0; i < frames; ++i) {
    for (std::size_t e = 0; e < bracket.size(); ++e) {
      FrameInfo& info = bracket[e].info;
      info.sequence = static_cast<std::uint64_t>(i) * bracket.size() + e;
      info.mid_exposure = {static_cast<std::int64_t>(i + 1) * 33'000'000 + static_cast<std::int64_t>(e) * 1'000'000};
      info.delivered = info.mid_exposure;
    }
    if (const Status s = (*estimator)->estimate(bracket, d); !s.ok()) fail(s);
    if (const auto bytes = encoder.encode(d); !bytes) fail(bytes.status());
  }
  std::printf("%d frames of %dx%d, %zu lights\n", frames, lens.width, lens.height, d.lights.size());
  return 0;
}
