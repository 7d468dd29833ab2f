// The estimator at `balanced` compared with other methods, one thread, on the same panorama: prints one JSON object per
// line for tests/figures: figure, ms (best of five runs of each, in turn), vector (vector unit of lightwell's kernels;
// the others are vectorized by their compiler), and error (of irradiance) if there is one.
//   measure_peers [--vector best|avx2|sse4]
//   ours.floats       the panorama in floats, from frame to encoded descriptor
//   filament          the panorama to nine coefficients (cube_ms, sh_ms)
//   median_cut        the panorama to 64 lights
//   ours.frame        an 8-bit frame of the whole sphere, from frame to encoded descriptor
//   s0_detection      the same 8-bit frame to the lights of Algorithm 1 of Alhakamy and Tuceryan 2019
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>

#include <nlohmann/json.hpp>

#include <lightwell/codec.hpp>
#include <lightwell/query.hpp>

#include "bench/alhakamy2019.hpp"
#include "bench/ar_output.hpp"
#include "bench/filament_sh.hpp"
#include "bench/median_cut.hpp"
#include "bench/vector_unit.hpp"
#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/output.hpp"
#include "measure/panorama_truth.hpp"
#include "measure/shots.hpp"
#include "sim/panorama.hpp"
#include "sim/sensor.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
namespace ref = reference;

constexpr int kRuns = 5;

std::string vector_unit;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_peers: %s\n", s.message().c_str());
  std::exit(1);
}

/// lightwell's panorama estimator, from frame to encoded descriptor, with advancing time.
class LightwellMethod {
 public:
  LightwellMethod(const RigParameters& rig, measure::Shot shot) : shot_(std::move(shot)) {
    PanoramaOptions options;
    options.config.setting = Setting::balanced;
    auto made = make_panorama_estimator(rig, options);
    if (!made) fail(made.status());
    estimator_ = std::move(*made);
  }
  void run() {
    FrameInfo& info = shot_.frames.front().info;
    ++info.sequence;
    info.mid_exposure.ns += 33'000'000;
    info.delivered.ns += 33'000'000;
    if (const Status s = estimator_->estimate(shot_.frames, descriptor); !s.ok()) fail(s);
    if (const auto bytes = encoder_.encode(descriptor); !bytes) fail(bytes.status());
  }
  Descriptor descriptor;

 private:
  measure::Shot shot_;
  std::unique_ptr<Estimator> estimator_;
  Encoder encoder_;
};

struct Timed {
  std::function<void()> run;
  double best = 1e9;
};

void print(const char* figure, double seconds, double error) {
  measure::print_line({{"figure", figure}, {"ms", seconds * 1e3}, {"vector", vector_unit}, {"error", error}});
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"The estimator compared with other methods on the same panorama.", "measure_peers"};
  std::string vector = "best";
  app.add_option("--vector", vector, "best, avx2 or sse4: largest vector unit of the kernels [best]");
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  Result<std::string> unit = bench::select_vector_unit(vector);
  if (!unit) return wrong_usage(app, unit.status().message());
  vector_unit = std::move(*unit);
  const Result<std::string> path = sim::scene_path("city");
  if (!path) fail(path.status());
  const Result<measure::PanoramaTruth> truth = measure::load_panorama_truth(*path);
  if (!truth) fail(truth.status());
  const Result<sim::Panorama> panorama = sim::load_panorama(*path);
  if (!panorama) fail(panorama.status());
  const int width = panorama->width, height = panorama->height;
  const bench::EquirectImage image{width, height, panorama->rgb};

  const RigParameters float_rig = *sim::make_rig("equirect", width, height, PixelFormat::rgb_f32);
  const measure::LensRadiance radiance = {panorama->rgb};
  const double second[] = {1};
  LightwellMethod floats(float_rig, measure::Camera(float_rig, PixelFormat::rgb_f32).expose(radiance, second, 0));

  const RigParameters code_rig = *sim::make_rig("equirect", width, height, PixelFormat::rgb8);
  // Four times the mean is just below saturation, as with a typical exposure control: the lamps are clipped.
  const double exposure = sim::exposure_below_saturation(sim::sensor_of(code_rig, PixelFormat::rgb8, 1),
                                                         4 * sim::mean_luminance(*panorama), 1);
  const double once[] = {exposure};
  measure::Shot shot = measure::Camera(code_rig, PixelFormat::rgb8).expose(radiance, once, 0);
  const std::vector<std::byte> codes = shot.pixels.front();
  const bench::EquirectFrame frame{width,
                                   height,
                                   {reinterpret_cast<const std::uint8_t*>(codes.data()), codes.size()},
                                   shot.frames.front().views().front().stride};
  LightwellMethod coded(code_rig, std::move(shot));

  bench::FilamentRoute filament;
  bench::FilamentSh sh;
  double cube_s = 1e9, sh_s = 1e9;
  if (bench::FilamentRoute::available()) filament.load(image);
  std::vector<bench::CutLight> cut;
  bench::AlhakamyResult s0;

  Timed ours_floats{[&] { floats.run(); }}, ours_frame{[&] { coded.run(); }},
      by_cut{[&] { cut = bench::median_cut(image); }}, by_s0{[&] { s0 = bench::alhakamy_detect(frame); }},
      by_filament{[&] {
        sh = filament.run();
        cube_s = std::min(cube_s, sh.cube_s);
        sh_s = std::min(sh_s, sh.sh_s);
      }};
  for (int run = 0; run < kRuns; ++run) {
    for (Timed* t : {&ours_floats, &by_cut, &ours_frame, &by_s0, &by_filament}) {
      if (t == &by_filament && !bench::FilamentRoute::available()) continue;
      // One unmeasured run, so that every method starts with its data in the cache, as in continuous operation.
      if (t != &by_filament) t->run();
      const double start = bench::seconds_now();
      t->run();
      t->best = std::min(t->best, bench::seconds_now() - start);
    }
  }

  const auto error = [&](const auto& irradiance) {
    return measure::irradiance_error(*truth,
                                     [&](const ref::V3& n) {
                                       const auto v = irradiance(n);
                                       return ref::Rgb{v[0], v[1], v[2]};
                                     })
        .rms;
  };
  const auto of_descriptor = [](const Descriptor& d) {
    return [&d](const ref::V3& n) {
      const Irradiance v = irradiance_at(d, vec_cast<float>(Vec3d{n.x, n.y, n.z}));
      return bench::Triple{v.r, v.g, v.b};
    };
  };
  print("ours.floats", ours_floats.best, error(of_descriptor(floats.descriptor)));
  if (bench::FilamentRoute::available()) {
    const double e = error([&](const ref::V3& n) { return bench::irradiance_of(sh.radiance, {n.x, n.y, n.z}); });
    // Times of Filament's two steps only; other work of run() does not belong to Filament.
    measure::print_line({{"figure", "filament"},
                         {"ms", (cube_s + sh_s) * 1e3},
                         {"cube_ms", cube_s * 1e3},
                         {"sh_ms", sh_s * 1e3},
                         {"error", e}});
  }
  print("median_cut", by_cut.best, error([&](const ref::V3& n) { return bench::irradiance_of(cut, {n.x, n.y, n.z}); }));
  print("ours.frame", ours_frame.best, std::nan(""));
  print("s0_detection", by_s0.best, std::nan(""));
  return 0;
}
