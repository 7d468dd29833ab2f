#include "camera/backends/sim/sim_world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "camera/uri_parameters.hpp"
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

Status bad(const std::string& what) { return {StatusCode::invalid_argument, what}; }

Status set_parameter(SimOptions& options, const std::string& name, const std::string& value) {
  if (name == "rig") {
    options.rig = value;
    return {};
  }
  if (name == "sensor") {
    const auto format = pixel_format_of(value);
    if (format) {
      options.sensor = *format;
      return {};
    }
    std::string known;
    for (const PixelFormat f : kPixelFormats) known += (known.empty() ? "" : ", ") + std::string(to_string(f));
    return bad("'" + value + "' is none of " + known);
  }
  if (name == "yaw_rate") return assign(options.yaw_rate_rad_per_s, parse_yaw_rate_rad_per_s(value));
  if (name == "lamp_switch") return assign(options.lamp_switch_s, uri_duration_s(value));
  if (name == "row_readout") return assign(options.row_readout_s, uri_duration_s(value));
  if (name == "flicker") return assign(options.flicker.hz, parse_frequency_hz(value));
  if (name == "depth") return assign(options.flicker.depth, uri_number(value, 0.0, 1.0));
  if (name == "frames") return assign(options.frames, uri_number<std::size_t>(value, 1, 100000));
  return assign(options.seed, uri_number<std::uint64_t>(value, 0, ~std::uint64_t{0}));
}

Status check(const SimOptions& options) {
  if (!(options.frame_rate >= 0 && options.frame_rate <= 10000))
    return bad("frame_rate must lie between 0 (as fast as frames are taken) and 10000");
  if (options.flicker.hz > 0 && options.frame_rate == 0)
    return bad("flicker needs frames at known times: camera.frame_rate must be above 0");
  return {};
}

}  // namespace

Result<double> parse_frequency_hz(std::string_view text) {
  Result<double> hz = uri_quantity(text, {{"hz", 1}, {"Hz", 1}, {"", 1}});
  if (hz && !(*hz > 0 && *hz <= 1000)) return bad("'" + std::string(text) + "' does not lie between 0 and 1000 Hz");
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
  for (const auto& [name, value] : parameters->own) {
    if (Status set = set_parameter(options, name, value); !set.ok()) return bad("sim: " + name + ": " + set.message());
  }
  for (const auto& [name, value] : parameters->own) {
    if (name == "depth" && options.flicker.hz == 0)
      return bad("sim: depth=" + value + " requires flicker: add flicker=100hz");
  }
  if (Status sane = check(options); !sane.ok()) return bad("sim: " + sane.message());
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
