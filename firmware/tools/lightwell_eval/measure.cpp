#include "tools/lightwell_eval/measure.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <unistd.h>

#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>

#include <lightwell/codec.hpp>
#include <lightwell/query.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "sim/sensor.hpp"
#include "tools/command_line.hpp"

namespace lightwell::eval {
namespace {

constexpr std::size_t kBuffers = 32;
/// Below this ratio of peak to mean luminance, a scene has no dominant light direction.
constexpr double kMinPeakToMean = 100;
/// After this time, s, a slow case gets no further passes beyond two.
constexpr double kMaxSeconds = 2;
/// Frame numbers from the start of one pass to that of the next: half a minute of simulated time.
constexpr std::uint64_t kPassStride = 1000;

std::unique_ptr<Estimator> estimator_of(const Case& c, const RigParameters& rig) {
  PanoramaOptions options;
  options.config = c.config;
  options.block_edge = c.block_edge;
  return require(make_panorama_estimator(rig, options));
}

/// CPU time of this thread, which excludes the time taken by other programs.
double seconds_now() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// User-space instructions of `work` by perf_event_open; nullopt if it is not available (paranoid, a virtual machine).
std::optional<std::uint64_t> count_instructions(const std::function<void()>& work) {
  perf_event_attr what{};
  what.type = PERF_TYPE_HARDWARE;
  what.size = sizeof what;
  what.config = PERF_COUNT_HW_INSTRUCTIONS;
  what.disabled = 1;
  what.exclude_kernel = 1;
  what.exclude_hv = 1;
  what.read_format = PERF_FORMAT_TOTAL_TIME_ENABLED | PERF_FORMAT_TOTAL_TIME_RUNNING;
  const auto counter = static_cast<int>(syscall(SYS_perf_event_open, &what, 0, -1, -1, PERF_FLAG_FD_CLOEXEC));
  if (counter < 0) return std::nullopt;
  ioctl(counter, PERF_EVENT_IOC_RESET, 0);
  ioctl(counter, PERF_EVENT_IOC_ENABLE, 0);
  work();
  ioctl(counter, PERF_EVENT_IOC_DISABLE, 0);
  struct {
    std::uint64_t count, enabled_ns, running_ns;
  } result{};
  const bool complete = read(counter, &result, sizeof result) == sizeof result;
  close(counter);
  // A multiplexed counter has counted only a part of the work.
  if (!complete || result.count == 0 || result.running_ns < result.enabled_ns) return std::nullopt;
  return result.count;
}

/// Time per buffer: the minimum over the passes, averaged over the buffers.
class BestOf {
 public:
  void pass(const std::function<void(std::size_t)>& work) {
    for (std::size_t i = 0; i < kBuffers; ++i) {
      const double start = seconds_now();
      work(i);
      best_[i] = std::min(best_[i], seconds_now() - start);
    }
  }
  [[nodiscard]] double mean() const { return std::accumulate(best_.begin(), best_.end(), 0.0) / kBuffers; }

 private:
  std::vector<double> best_ = std::vector<double>(kBuffers, std::numeric_limits<double>::infinity());
};

void find_errors(const Descriptor& d, const GroundTruth& truth, const BallPictures& balls, Outcome& out) {
  std::vector<Color> irradiances;
  for (const Vec3d& n : truth_normals()) {
    const Irradiance e = irradiance_at(d, vec_cast<float>(n));
    irradiances.push_back({e.r, e.g, e.b});
  }
  const RelativeError error = relative_error(truth.irradiances(), irradiances);
  out.rms = error.rms;
  out.largest = error.largest;
  if (truth.peak_to_mean() >= kMinPeakToMean) {
    out.light_deg = 180;
    for (const Light& light : d.lights) {
      const Vec3d l = vec_cast<double>(light.direction), b = truth.brightest();
      out.light_deg = std::min(*out.light_deg, angle_between(l, b) * 180 / std::numbers::pi);
    }
  }
  out.balls = ball_errors(balls, ball_pictures(d));
  out.bound = static_cast<double>(d.bound.total);
  out.map = d.environment && d.environment->whole();
}

}  // namespace

std::vector<Case> all_cases() {
  std::vector<Case> out;
  const auto add = [&](std::string label, std::string_view parameter) -> Case& {
    Case& c = out.emplace_back();
    c.label = std::move(label);
    c.parameter = parameter;
    return c;
  };
  for (const int width : {640, 320, 1280}) {
    for (const Setting setting : kSettings) {
      // Frames of floats, which the ideal sensor gives, are always read whole: fastest is fast.
      if (setting == Setting::fastest) continue;
      Case& c = add(std::string(to_string(setting)) + (width == 640 ? "" : " @" + std::to_string(width)), "setting");
      c.width = width;
      c.height = width * 3 / 4;
      c.config.setting = setting;
      c.named = true;
    }
  }
  // With epsilon 0, so that the descriptor is not reduced and the error is that of the block size.
  for (const int edge : {2, 4, 8, 16}) {
    Case& c = add("block " + std::to_string(edge) + ", eps 0", "block");
    c.block_edge = edge;
    c.config.panorama.epsilon = 0;
  }
  for (const int band : {0, 1, 2, 4}) add("band " + std::to_string(band), "band").config.band = band;
  for (const int lights : {0, 1, 4, 64}) add("lights " + std::to_string(lights), "lights").config.max_lights = lights;
  for (const double percent : {0.2, 0.5, 2.0, 5.0}) {
    std::string text = std::to_string(percent);
    text.resize(3);
    add("eps " + text + " %", "epsilon").config.panorama.epsilon = percent / 100;
  }
  for (const int edge : {8, 16, 32, 64})
    add("map " + std::to_string(edge), "map").config.panorama.environment_edge = edge;
  for (const int exposures : {1, 3}) {
    for (const Setting setting : kSettings) {
      Case& c = add("8 bit x" + std::to_string(exposures) + " " + std::string(to_string(setting)), "sensor");
      c.sensor = Sensor::eight_bit;
      c.exposures = exposures;
      c.config.setting = setting;
      // A single exposure clips every lamp, which no setting changes (the descriptor is flagged).
      c.named = exposures > 1;
    }
  }
  return out;
}

std::vector<Frame> RenderedBracket::frames(std::span<const std::byte> memory, std::uint64_t number) const {
  std::vector<Frame> out;
  std::size_t picture = 0;
  for (std::size_t e = 0; e < exposures.size(); ++e) {
    Frame& frame = out.emplace_back();
    frame.info.sequence = number * exposures.size() + e;
    frame.info.mid_exposure = {static_cast<std::int64_t>(number + 1) * 33'000'000 +
                               static_cast<std::int64_t>(e) * 1'000'000};
    frame.info.delivered = frame.info.mid_exposure;
    frame.info.exposure_s = exposures[e];
    frame.info.bracket_index = static_cast<int>(e);
    frame.info.bracket_size = static_cast<int>(exposures.size());
    for (std::size_t k = 0; k < rig.lenses.size(); ++k, ++picture) {
      const LensParameters& lens = rig.lenses[k];
      const std::size_t stride = packed_stride(format, lens.width);
      frame.add_view({static_cast<int>(k), format, lens.width, lens.height, stride,
                      memory.subspan(offsets[picture], picture_bytes(format, stride, lens.height))});
    }
  }
  return out;
}

CameraRenderer::CameraRenderer(const sim::Scene& scene, int width, int height) : width_(width), height_(height) {
  const sim::SceneState state = scene.state_at(0);
  const sim::Panorama& panorama = scene.panorama(state);
  bright_ = sim::luminance_percentile(panorama, 0.99);
  for (const float v : panorama.rgb) peak_ = std::max(peak_, static_cast<double>(v));
  const RigParameters rig = require(sim::make_rig("pair", width, height, PixelFormat::rgb_f32));
  for (const LensParameters& lens : rig.lenses)
    radiance_.push_back(sim::render_radiance(scene, state, lens, sim::samples_for(lens, panorama)));
}

RenderedBracket CameraRenderer::bracket(Sensor sensor, int exposures) const {
  const PixelFormat format = sensor == Sensor::ideal ? PixelFormat::rgb_f32 : PixelFormat::rgb8;
  std::vector<double> radiances;  // At full scale.
  for (int i = 0; exposures > 1 && i < exposures; ++i)
    radiances.push_back(peak_ * std::pow(std::min(1.0, bright_ / peak_), static_cast<double>(i) / (exposures - 1)));
  if (exposures == 1) radiances = {sensor == Sensor::ideal ? 1 : bright_};
  RenderedBracket out;
  out.rig = require(sim::make_rig("pair", width_, height_, format));
  out.format = format;
  const sim::SensorModel model = sim::sensor_of(out.rig, format, 1);
  std::vector<sim::Sensor> sensors;
  for (const LensParameters& lens : out.rig.lenses) sensors.emplace_back(lens, model);
  for (std::size_t e = 0; e < radiances.size(); ++e) {
    out.exposures.push_back(sim::exposure_below_saturation(model, radiances[e], 1));
    for (std::size_t k = 0; k < sensors.size(); ++k) {
      out.offsets.push_back(out.bytes.size());
      out.bytes.resize(out.bytes.size() + sensors[k].bytes());
      sensors[k].expose(radiance_[k], {out.exposures.back(), 1, e, static_cast<int>(k)},
                        std::span(out.bytes).subspan(out.offsets.back()));
    }
  }
  return out;
}

Outcome Bench::measure(const Case& c, const GroundTruth& truth, const BallPictures& balls,
                       const CameraRenderer& camera) {
  Outcome out;
  const RenderedBracket timed = camera.bracket(Sensor::eight_bit, c.exposures);
  time(c, timed, out);
  const RenderedBracket evaluated = c.sensor == Sensor::ideal ? camera.bracket(Sensor::ideal, 1) : timed;
  Descriptor made;
  require(estimator_of(c, evaluated.rig)->estimate(evaluated.frames(evaluated.bytes, 0), made));
  Encoder encoder;
  const std::span<const std::byte> bytes = require(encoder.encode(made));
  out.bytes = static_cast<double>(bytes.size());
  // The errors are those of the decoded descriptor, including rounding by the encoding.
  find_errors(require(decode_descriptor(bytes)), truth, balls, out);
  return out;
}

void Bench::time(const Case& c, const RenderedBracket& bracket, Outcome& out) {
  const std::unique_ptr<Estimator> estimator = estimator_of(c, bracket.rig);
  buffers_.resize(kBuffers);
  std::vector<std::vector<Frame>> frames;
  for (std::size_t i = 0; i < kBuffers; ++i) {
    buffers_[i] = bracket.bytes;
    frames.push_back(bracket.frames(buffers_[i], i));
  }
  Encoder encoder;
  Descriptor made;
  // Each pass begins long after the one before: work at a lower rate (maps) is due in the same buffers of every pass.
  std::uint64_t number = 0;
  const auto one = [&](std::size_t i) {
    number = i == 0 ? (number / kPassStride + 1) * kPassStride : number + 1;
    for (Frame& frame : frames[i]) {
      frame.info.mid_exposure = {static_cast<std::int64_t>(number) * 33'000'000 + frame.info.bracket_index * 1'000'000};
      frame.info.delivered = frame.info.mid_exposure;
    }
    require(estimator->estimate(frames[i], made));
    require(encoder.encode(made).status());
  };
  BestOf estimates;
  const double start = seconds_now();
  for (int i = 0; i < passes_ && (i < 2 || seconds_now() - start < kMaxSeconds); ++i) estimates.pass(one);
  out.seconds = estimates.mean();
  double pixels = 0;
  for (const LensParameters& lens : bracket.rig.lenses)
    pixels += static_cast<double>(lens.width) * lens.height * static_cast<double>(bracket.exposures.size());
  if (const auto count = count_instructions([&] {
        for (std::size_t i = 0; i < kBuffers; ++i) one(i);
      }))
    out.instructions_per_pixel = static_cast<double>(*count) / kBuffers / pixels;
  out.picture_bytes = bracket.bytes.size();

  frames.clear();
  double& best =
      memcpy_seconds_.try_emplace(bracket.bytes.size(), std::numeric_limits<double>::infinity()).first->second;
  BestOf copies;
  for (int i = 0; i < passes_; ++i)
    copies.pass([&](std::size_t b) {
      std::memcpy(buffers_[(b + 1) % kBuffers].data(), buffers_[b].data(), bracket.bytes.size());
    });
  best = std::min(best, copies.mean());
}

}  // namespace lightwell::eval
