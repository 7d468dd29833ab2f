#include "camera/backends/sim/sim_backend.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "sim/panorama.hpp"
#include "sim/rigs.hpp"

namespace lightwell {

namespace {

// CLOCK_MONOTONIC, by libstdc++'s definition: the probe's clock.
using Clock = std::chrono::steady_clock;

// Scene time needs a rate even where frames have none.
constexpr double kNominalRate = 30;
// No exposure of ours is shorter: what a small sensor can do.
constexpr double kShortestExposure = 1e-6;

ProbeTime probe_time(Clock::time_point t) {
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(t.time_since_epoch()).count()};
}

}  // namespace

SimBackend::SimBackend(SimOptions options) : options_(std::move(options)) {}

SimBackend::~SimBackend() { stop(); }

double SimBackend::scene_rate() const {
  return options_.frame_rate > 0 ? options_.frame_rate : kNominalRate;
}

Result<CameraInfo> SimBackend::open() {
  if (scene_) return Status(StatusCode::failed_precondition, "sim: the camera is open already");
  if (options_.rig == "equirect") options_.height = options_.width / 2;
  const auto failed = [](const Status& status) {
    return Status(status.code(), "sim: " + status.message());
  };
  Result<RigParameters> rig =
      sim::make_rig(options_.rig, options_.width, options_.height, options_.sensor);
  if (!rig) return failed(rig.status());
  rig_ = std::move(*rig);

  const Result<std::string> path = sim::scene_path(options_.scene);
  if (!path) return failed(path.status());
  Result<sim::Panorama> panorama = sim::load_panorama(*path);
  if (!panorama) return failed(panorama.status());
  cleaning_ = panorama->cleaning;

  if (options_.exposure_s.empty()) options_.exposure_s = {suitable_exposure(*panorama)};
  lower_rate();
  const Result<RingPlan> plan = plan_ring();
  if (!plan) return plan.status();

  sim::Motion motion;
  motion.turn_rad_per_s = options_.turn_rad_per_s;
  motion.frame_rate = scene_rate();
  motion.cycle_frames = plan->cycle;
  motion.switch_period_frames = plan->switch_period;
  scene_.emplace(std::move(*panorama), motion);

  RingSource source;
  source.scene = &*scene_;
  source.rig = &rig_;
  source.sensor = sim::sensor_of(rig_, options_.sensor, options_.seed);
  source.exposure_s = options_.exposure_s;
  source.gain = options_.gain;
  source.readout_s = options_.readout_s;
  source.flicker = {plan->periods_per_frame * scene_rate(), options_.flicker.depth};
  source.frame_rate = scene_rate();
  source.takes_time = options_.sensor != PixelFormat::rgb_f32;
  ring_.render(*plan, source, progress_);
  return describe();
}

double SimBackend::suitable_exposure(const sim::Panorama& panorama) const {
  if (options_.sensor == PixelFormat::rgb_f32) return 1;
  const double exposure =
      sim::exposure_below_saturation(sim::sensor_of(rig_, options_.sensor, options_.seed),
                                     sim::luminance_percentile(panorama, 0.99), options_.gain);
  // A camera cannot expose for longer than a frame lasts.
  return std::clamp(exposure, kShortestExposure, 1 / scene_rate());
}

double SimBackend::exposing_s(double exposure_s) const {
  return options_.sensor == PixelFormat::rgb_f32 ? 0 : exposure_s;
}

void SimBackend::lower_rate() {
  double busy_s = options_.height * options_.readout_s;
  for (const double e : options_.exposure_s) busy_s = std::max(busy_s, exposing_s(e));
  // Of a rate of 0 nothing is promised.
  if (busy_s > 0) options_.frame_rate = std::min(options_.frame_rate, 1 / busy_s);
}

Result<RingPlan> SimBackend::plan_ring() const {
  RingRequest request;
  request.frames = options_.ring;
  request.bracket = options_.exposure_s.size();
  for (const LensParameters& lens : rig_.lenses) {
    request.bytes_per_picture +=
        picture_bytes(options_.sensor, packed_stride(options_.sensor, lens.width), lens.height);
  }
  if (options_.switch_s > 0) {
    const double frames = std::clamp(options_.switch_s * scene_rate(), 1.0, 1e6);
    request.switch_period = static_cast<std::uint64_t>(std::llround(frames));
  }
  request.periods_per_frame = options_.flicker.hz / scene_rate();
  const bool moves = options_.turn_rad_per_s != 0 || options_.flicker.hz > 0;
  return moves ? plan_moving(request) : plan_still(request);
}

CameraInfo SimBackend::describe() const {
  CameraInfo info;
  info.name = "sim:" + options_.scene;
  info.width = options_.width;
  info.height = options_.height;
  info.format = options_.sensor;
  info.lenses = static_cast<int>(rig_.lenses.size());
  info.frame_rate = options_.frame_rate;
  info.exposure_s = options_.exposure_s;
  info.calibration = rig_;
  if (cleaning_.any()) {
    info.notes.push_back("the panorama held numbers that are no radiance: replaced " +
                         std::to_string(cleaning_.nan) + " NaN, " +
                         std::to_string(cleaning_.infinite) + " infinite, " +
                         std::to_string(cleaning_.negative) + " negative values");
  }
  const RingPlan& plan = ring_.plan();
  if (plan.pictures() < plan.wanted) {
    info.notes.push_back("a ring of " + std::to_string(plan.pictures()) + " frames; " +
                         std::to_string(plan.wanted) + " would take more than 1 GiB");
  }
  if (options_.flicker.hz > 0) {
    const double hz = plan.periods_per_frame * scene_rate();
    if (std::abs(hz - options_.flicker.hz) > 1e-6 * hz) {
      info.notes.push_back("light flickers at " + std::to_string(hz) + " Hz, so that " +
                           std::to_string(plan.cycle) + " frames hold a whole number of periods");
    }
  }
  return info;
}

Status SimBackend::start(FrameSink& sink) {
  if (!scene_) return {StatusCode::failed_precondition, "sim: open the camera before starting it"};
  if (thread_.joinable()) return {StatusCode::failed_precondition, "sim: the camera is running"};
  stopping_ = false;
  state_ = State::streaming;
  thread_ = std::thread([this, &sink] { run(sink); });
  return {};
}

void SimBackend::stop() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
  state_ = State::idle;
}

void SimBackend::release(int /*slot*/) {
  {
    const std::lock_guard lock(mutex_);
    --lent_;
  }
  wake_.notify_all();
}

void SimBackend::run(FrameSink& sink) {
  const int limit = frames_to_lend(static_cast<int>(options_.exposure_s.size()));
  const double rate = options_.frame_rate;
  const std::uint64_t first = next_sequence_;
  const Clock::time_point start = Clock::now();
  // The first frame is exposed after the start, not before it.
  const auto due = [&](std::uint64_t tick) {
    const double s = static_cast<double>(tick + 1) / rate;
    return start + std::chrono::nanoseconds(std::llround(s * 1e9));
  };
  for (std::uint64_t tick = 0;;) {
    bool lend = false;
    {
      std::unique_lock lock(mutex_);
      if (rate > 0) {
        wake_.wait_until(lock, due(tick), [this] { return stopping_; });
      } else {
        wake_.wait(lock, [&] { return stopping_ || lent_ < limit; });
      }
      if (stopping_) return;
      lend = lent_ < limit;
      if (lend) ++lent_;
    }
    if (lend) push_frame(sink, first + tick, probe_time(rate > 0 ? due(tick) : Clock::now()));
    ++tick;
    if (rate > 0) {
      // Ticks that passed meanwhile are lost, not made up for in a burst: number k is due after
      // k + 1 intervals.
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
  for (std::size_t lens = 0; lens < rig_.lenses.size(); ++lens) {
    const LensParameters& parameters = rig_.lenses[lens];
    frame.add_view({static_cast<int>(lens), options_.sensor, parameters.width, parameters.height,
                    packed_stride(options_.sensor, parameters.width), ring_.view(picture, lens)});
  }
  FrameInfo& info = frame.info;
  info.sequence = sequence;
  info.bracket_size = static_cast<int>(plan.bracket);
  info.bracket_index = static_cast<int>(sequence % plan.bracket);
  info.exposure_s = options_.exposure_s[sequence % plan.bracket];
  info.gain = options_.gain;
  info.row_readout = Duration::from_seconds(options_.readout_s);
  // Without ticks frames come as densely as exposures may not: equal delays keep their order.
  const double exposing =
      exposing_s(options_.frame_rate > 0
                     ? info.exposure_s
                     : *std::max_element(options_.exposure_s.begin(), options_.exposure_s.end()));
  info.mid_exposure =
      due - Duration::from_seconds(exposing / 2 + options_.height / 2.0 * options_.readout_s);
  info.delivered = probe_time(Clock::now());
  sink.push(std::move(frame));
}

Result<std::unique_ptr<CameraBackend>> make_sim_backend(const CameraUri& uri,
                                                        const CameraConfig& config) {
  Result<SimOptions> options = parse_sim_options(uri, config);
  if (!options) return options.status();
  return std::unique_ptr<CameraBackend>(std::make_unique<SimBackend>(std::move(*options)));
}

}  // namespace lightwell
