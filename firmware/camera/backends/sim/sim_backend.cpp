#include "camera/backends/sim/sim_backend.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace lightwell {

namespace {

// The probe's clock: steady_clock is CLOCK_MONOTONIC in libstdc++.
using Clock = std::chrono::steady_clock;

ProbeTime probe_time(Clock::time_point t) {
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(t.time_since_epoch()).count()};
}

}  // namespace

Result<CameraInfo> SimBackend::open() {
  if (world_) return Status(StatusCode::failed_precondition, "sim: the camera is open already");
  Result<std::unique_ptr<SimWorld>> world = make_sim_world(options_);
  if (!world) return world.status();
  world_ = std::move(*world);
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
  if (sanitize_counts().any()) {
    info.notes.push_back("the panorama contained invalid radiance values: replaced " +
                         std::to_string(sanitize_counts().nan) + " NaN, " + std::to_string(sanitize_counts().infinite) +
                         " infinite, " + std::to_string(sanitize_counts().negative) + " negative values");
  }
  const RingPlan& plan = ring_.plan();
  if (plan.pictures() < plan.wanted) {
    info.notes.push_back("a ring of " + std::to_string(plan.pictures()) + " frames; " + std::to_string(plan.wanted) +
                         " would take more than 1 GiB");
  }
  if (options_.flicker.hz > 0) {
    const double hz = plan.periods_per_frame * scene_rate(options_);
    if (std::abs(hz - options_.flicker.hz) > 1e-6 * hz) {
      info.notes.push_back("light flickers at " + std::to_string(hz) + " Hz, so that " + std::to_string(plan.cycle) +
                           " frames hold a whole number of periods");
    }
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
      if (rate > 0) {
        wake_.wait_until(lock, stop, due(tick), [] { return false; });
      } else {
        wake_.wait(lock, stop, [&] { return lent_ < limit; });
      }
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
  // Without ticks frames may be closer together than exposures allow: subtracting the same delay from all keeps the
  // mid-exposure times in order.
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
