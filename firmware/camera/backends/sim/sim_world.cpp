#include "camera/backends/sim/sim_world.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "sim/rigs.hpp"

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
  for (const LensParameters& lens : rig.lenses) {
    request.bytes_per_picture += picture_bytes(options.sensor, packed_stride(options.sensor, lens.width), lens.height);
  }
  if (options.lamp_switch_s > 0) {
    const double frames = std::clamp(options.lamp_switch_s * scene_rate(options), 1.0, 1e6);
    request.switch_period = static_cast<std::uint64_t>(std::llround(frames));
  }
  request.periods_per_frame = options.flicker.hz / scene_rate(options);
  const bool moves = options.yaw_rate_rad_per_s != 0 || options.flicker.hz > 0;
  return moves ? plan_moving(request) : plan_still(request);
}

}  // namespace

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
  const auto failed = [](const Status& status) { return Status(status.code(), "sim: " + status.message()); };
  Result<RigParameters> rig = sim::make_rig(options.rig, options.width, options.height, options.sensor);
  if (!rig) return failed(rig.status());

  const Result<std::string> path = sim::scene_path(options.scene);
  if (!path) return failed(path.status());
  Result<sim::Panorama> panorama = sim::load_panorama(*path);
  if (!panorama) return failed(panorama.status());
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

}  // namespace lightwell
