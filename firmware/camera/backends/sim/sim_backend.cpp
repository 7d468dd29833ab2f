#include "camera/backends/sim/sim_backend.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <utility>

#include "camera/uri_parameters.hpp"
#include "sim/sensor.hpp"

namespace lightwell {
namespace {

// Frame rate of scene time if the camera has no frame rate.
constexpr double kNominalRate = 30;
// Shortest default exposure: typical limit of a small sensor.
constexpr double kMinExposure_s = 1e-6;

double suitable_exposure(const SimOptions& options, const RigParameters& rig, const sim::Panorama& panorama) {
  if (options.sensor == PixelFormat::rgb_f32) return 1;
  const double exposure =
      sim::exposure_below_saturation(sim::sensor_of(rig, options.sensor, options.seed),
                                     sim::luminance_percentile(panorama, 0.99), options.capture.gain.value_or(1));
  // The exposure cannot exceed the frame interval.
  return std::clamp(exposure, kMinExposure_s, 1 / scene_rate(options));
}

void lower_rate(SimOptions& options) {
  double busy_s = options.height * options.row_readout_s;
  for (const double e : options.capture.exposure_s) busy_s = std::max(busy_s, exposing_s(options, e));
  // A frame rate of 0 (on demand) stays 0.
  if (busy_s > 0) options.frame_rate = std::min(options.frame_rate, 1 / busy_s);
}

Result<RingPlan> plan_ring(const SimOptions& options, const RigParameters& rig) {
  RingRequest request;
  request.frames = options.frames;
  request.bracket = options.capture.exposure_s.size();
  for (const LensParameters& lens : rig.lenses)
    request.bytes_per_picture += picture_bytes(options.sensor, packed_stride(options.sensor, lens.width), lens.height);
  if (options.lamp_switch_s > 0) {
    const double frames = std::clamp(options.lamp_switch_s * scene_rate(options), 1.0, 1e6);
    request.switch_period = static_cast<std::uint64_t>(std::llround(frames));
  }
  request.periods_per_frame = options.flicker.hz / scene_rate(options);
  const bool moves = options.yaw_rate_rad_per_s != 0 || options.flicker.hz > 0;
  return moves ? plan_moving(request) : plan_still(request);
}

Status set_parameter(SimOptions& options, const std::string& name, const std::string& value) {
  if (name == "rig") return Result<std::string>(value).assign_to(options.rig);
  if (name == "sensor") {
    if (const auto format = pixel_format_of(value)) {
      options.sensor = *format;
      return {};
    }
    std::string known;
    for (const PixelFormat f : kPixelFormats) known += (known.empty() ? "" : ", ") + std::string(to_string(f));
    return invalid_argument("'" + value + "' is none of " + known);
  }
  if (name == "yaw_rate") return parse_yaw_rate_rad_per_s(value).assign_to(options.yaw_rate_rad_per_s);
  if (name == "lamp_switch") return uri_duration_s(value).assign_to(options.lamp_switch_s);
  if (name == "row_readout") return uri_duration_s(value).assign_to(options.row_readout_s);
  if (name == "flicker") return parse_frequency_hz(value).assign_to(options.flicker.hz);
  if (name == "depth") return uri_number(value, 0.0, 1.0).assign_to(options.flicker.depth);
  if (name == "frames") return uri_number<std::size_t>(value, 1, 100000).assign_to(options.frames);
  return uri_number<std::uint64_t>(value, 0, ~std::uint64_t{0}).assign_to(options.seed);
}

Status check(const SimOptions& options) {
  if (!(options.frame_rate >= 0 && options.frame_rate <= 10000))
    return invalid_argument("frame_rate must lie between 0 (as fast as frames are taken) and 10000");
  if (options.flicker.hz > 0 && options.frame_rate == 0)
    return invalid_argument("flicker needs frames at known times: camera.frame_rate must be above 0");
  return {};
}

// The probe's clock: steady_clock is CLOCK_MONOTONIC in libstdc++.
using Clock = std::chrono::steady_clock;

ProbeTime probe_time(Clock::time_point t) {
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(t.time_since_epoch()).count()};
}

}  // namespace

Result<double> parse_frequency_hz(std::string_view text) {
  Result<double> hz = uri_quantity(text, {{"hz", 1}, {"Hz", 1}, {"", 1}});
  if (hz && !(*hz > 0 && *hz <= 1000))
    return invalid_argument("'" + std::string(text) + "' does not lie between 0 and 1000 Hz");
  return hz;
}

Result<double> parse_yaw_rate_rad_per_s(std::string_view text) {
  constexpr double kDegree = std::numbers::pi / 180;
  return uri_quantity(text, {{"deg/s", kDegree}, {"rad/s", 1}, {"", kDegree}});
}

Result<SimOptions> parse_sim_options(const CameraUri& uri, const CameraConfig& config) {
  static const ParameterNames kNames = {
      .capture = {"exposure", "gain"},
      .own = {"rig", "sensor", "yaw_rate", "lamp_switch", "frames", "seed", "row_readout", "flicker", "depth"},
      .renamed = {{"turn", "yaw_rate"}, {"switch", "lamp_switch"}, {"ring", "frames"}, {"readout", "row_readout"}}};
  Result<UriParameters> parameters = read_parameters(uri, config, kNames);
  if (!parameters) return parameters.status();
  SimOptions options;
  options.capture = std::move(parameters->capture);
  options.notes = std::move(parameters->warnings);
  options.scene = uri.path;
  options.width = config.width;
  options.height = config.height;
  options.frame_rate = config.frame_rate;
  for (const auto& [name, value] : parameters->own)
    if (Status set = set_parameter(options, name, value); !set.ok())
      return invalid_argument("sim: " + name + ": " + set.message());
  for (const auto& [name, value] : parameters->own)
    if (name == "depth" && options.flicker.hz == 0)
      return invalid_argument("sim: depth=" + value + " requires flicker: add flicker=100hz");
  if (Status sane = check(options); !sane.ok()) return invalid_argument("sim: " + sane.message());
  return options;
}

double scene_rate(const SimOptions& options) { return options.frame_rate > 0 ? options.frame_rate : kNominalRate; }

double exposing_s(const SimOptions& options, double exposure_s) {
  return options.sensor == PixelFormat::rgb_f32 ? 0 : exposure_s;
}

RingSource SimWorld::source() const {
  return {&scene,
          &rig,
          sim::sensor_of(rig, options.sensor, options.seed),
          options.capture.exposure_s,
          options.capture.gain.value_or(1),
          timing()};
}

ExposureTiming SimWorld::timing() const {
  return {options.row_readout_s,
          {plan.periods_per_frame * scene_rate(options), options.flicker.depth},
          scene_rate(options),
          options.sensor != PixelFormat::rgb_f32};
}

Result<std::unique_ptr<SimWorld>> make_sim_world(SimOptions options) {
  if (options.rig == "equirect") options.height = options.width / 2;
  Result<RigParameters> rig = sim::make_rig(options.rig, options.width, options.height, options.sensor);
  if (!rig) return rig.status().in("sim");

  const Result<std::string> path = sim::scene_path(options.scene);
  if (!path) return path.status().in("sim");
  Result<sim::Panorama> panorama = sim::load_panorama(*path);
  if (!panorama) return panorama.status().in("sim");
  const sim::SanitizeCounts sanitize_counts = panorama->sanitize_counts;

  std::vector<double>& exposure_s = options.capture.exposure_s;
  if (exposure_s.empty()) exposure_s = {suitable_exposure(options, *rig, *panorama)};
  lower_rate(options);
  const Result<RingPlan> plan = plan_ring(options, *rig);
  if (!plan) return plan.status();

  sim::Motion motion;
  motion.turn_rad_per_s = options.yaw_rate_rad_per_s;
  motion.frame_rate = scene_rate(options);
  motion.cycle_frames = plan->cycle;
  motion.switch_period_frames = plan->switch_period;
  return std::make_unique<SimWorld>(
      SimWorld{std::move(options), std::move(*rig), sanitize_counts, *plan, sim::Scene(std::move(*panorama), motion)});
}

Result<CameraInfo> SimBackend::open() {
  if (world_) return Status(StatusCode::failed_precondition, "sim: the camera is open already");
  if (Status s = make_sim_world(options_).assign_to(world_); !s.ok()) return s;
  options_ = world_->options;
  ring_.render(world_->plan, world_->source(), progress_);
  return describe();
}

CameraInfo SimBackend::describe() const {
  CameraInfo info;
  info.name = "sim:" + options_.scene;
  info.width = options_.width;
  info.height = options_.height;
  info.format = options_.sensor;
  info.lenses = static_cast<int>(world_->rig.lenses.size());
  info.frame_rate = options_.frame_rate;
  info.exposure_s = options_.capture.exposure_s;
  info.calibration = world_->rig;
  info.notes = options_.notes;
  if (sanitize_counts().any())
    info.notes.push_back("the panorama contained invalid radiance values: replaced " +
                         std::to_string(sanitize_counts().nan) + " NaN, " + std::to_string(sanitize_counts().infinite) +
                         " infinite, " + std::to_string(sanitize_counts().negative) + " negative values");
  const RingPlan& plan = ring_.plan();
  if (plan.pictures() < plan.wanted)
    info.notes.push_back("a ring of " + std::to_string(plan.pictures()) + " frames; " + std::to_string(plan.wanted) +
                         " would take more than 1 GiB");
  if (options_.flicker.hz > 0) {
    const double hz = plan.periods_per_frame * scene_rate(options_);
    if (std::abs(hz - options_.flicker.hz) > 1e-6 * hz)
      info.notes.push_back("light flickers at " + std::to_string(hz) + " Hz, so that " + std::to_string(plan.cycle) +
                           " frames hold a whole number of periods");
  }
  return info;
}

void SimBackend::release(int /*slot*/) {
  {
    const std::lock_guard lock(mutex_);
    --lent_;
  }
  wake_.notify_all();
}

void SimBackend::run(FrameSink& sink, const std::stop_token& stop) {
  const int limit = required_buffer_count(static_cast<int>(options_.capture.exposure_s.size()));
  const double rate = options_.frame_rate;
  const std::uint64_t first = next_sequence_;
  const Clock::time_point start = Clock::now();
  // The first frame's exposure begins after start().
  const auto due = [&](std::uint64_t tick) {
    const double s = static_cast<double>(tick + 1) / rate;
    return start + std::chrono::nanoseconds(std::llround(s * 1e9));
  };
  for (std::uint64_t tick = 0;;) {
    if (!(rate > 0) && !sink.wait_for_space(stop)) return;
    bool lend = false;
    {
      std::unique_lock lock(mutex_);
      if (rate > 0)
        wake_.wait_until(lock, stop, due(tick), [] { return false; });
      else
        wake_.wait(lock, stop, [&] { return lent_ < limit; });
      if (stop.stop_requested()) return;
      lend = lent_ < limit;
      if (lend) ++lent_;
    }
    if (lend) push_frame(sink, first + tick, probe_time(rate > 0 ? due(tick) : Clock::now()));
    ++tick;
    if (rate > 0) {
      // Missed ticks are skipped instead of made up for in a burst: tick k is due after k + 1 intervals.
      const std::chrono::duration<double> passed = Clock::now() - start;
      tick = std::max(tick, static_cast<std::uint64_t>(passed.count() * rate));
    }
    next_sequence_ = first + tick;
  }
}

void SimBackend::push_frame(FrameSink& sink, std::uint64_t sequence, ProbeTime due) {
  const RingPlan& plan = ring_.plan();
  const std::uint64_t picture = plan.picture(sequence);
  Frame frame(*this, static_cast<int>(picture));
  for (std::size_t lens = 0; lens < world_->rig.lenses.size(); ++lens) {
    const LensParameters& parameters = world_->rig.lenses[lens];
    frame.add_view({static_cast<int>(lens), options_.sensor, parameters.width, parameters.height,
                    packed_stride(options_.sensor, parameters.width), ring_.view(picture, lens)});
  }
  FrameInfo& info = frame.info;
  info.sequence = sequence;
  info.bracket_size = static_cast<int>(plan.bracket);
  info.bracket_index = static_cast<int>(sequence % plan.bracket);
  const std::vector<double>& exposure_s = options_.capture.exposure_s;
  info.exposure_s = exposure_s[sequence % plan.bracket];
  info.gain = options_.capture.gain.value_or(1);
  info.row_readout = Duration::from_seconds(options_.row_readout_s);
  // Without ticks frames may be closer together than exposures allow: the same delay for all keeps the times in order.
  const double exposing = exposing_s(
      options_, options_.frame_rate > 0 ? info.exposure_s : *std::max_element(exposure_s.begin(), exposure_s.end()));
  info.mid_exposure = due - Duration::from_seconds(exposing / 2 + options_.height / 2.0 * options_.row_readout_s);
  info.delivered = probe_time(Clock::now());
  sink.push(std::move(frame));
}

Result<std::unique_ptr<CameraBackend>> make_sim_backend(const CameraUri& uri, const CameraConfig& config) {
  Result<SimOptions> options = parse_sim_options(uri, config);
  if (!options) return options.status();
  return std::unique_ptr<CameraBackend>(std::make_unique<SimBackend>(std::move(*options)));
}

}  // namespace lightwell
