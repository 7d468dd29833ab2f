#include "camera/backends/sim/sim_options.hpp"

#include <cmath>
#include <numbers>

#include "camera/bracket_cycle.hpp"
#include "imaging/frame.hpp"
#include "imaging/uri_values.hpp"

namespace lightwell {

namespace {

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
  if (name == "turn") return assign(options.turn_rad_per_s, parse_turn_rad_per_s(value));
  if (name == "switch") return assign(options.switch_s, uri_duration_s(value));
  if (name == "readout") return assign(options.readout_s, uri_duration_s(value));
  if (name == "exposure") return assign(options.exposure_s, uri_durations_s(value));
  if (name == "flicker") return assign(options.flicker.hz, parse_frequency_hz(value));
  if (name == "depth") return assign(options.flicker.depth, uri_number(value, 0.0, 1.0));
  if (name == "ring") return assign(options.ring, uri_number<std::size_t>(value, 1, 100000));
  return assign(options.seed, uri_number<std::uint64_t>(value, 0, ~std::uint64_t{0}));
}

Status check(const SimOptions& options) {
  if (!options.exposure_s.empty())
    if (const Status s = check_exposures(options.exposure_s); !s.ok()) return s;
  if (!(options.gain > 0) || !std::isfinite(options.gain)) return bad("gain must be above zero");
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

Result<double> parse_turn_rad_per_s(std::string_view text) {
  constexpr double kDegree = std::numbers::pi / 180;
  return uri_quantity(text, {{"deg/s", kDegree}, {"rad/s", 1}, {"", kDegree}});
}

Result<SimOptions> parse_sim_options(const CameraUri& uri, const CameraConfig& config) {
  static const std::vector<std::string_view> kKnown = {"rig",  "sensor",  "turn",     "switch",  "ring",
                                                       "seed", "readout", "exposure", "flicker", "depth"};
  if (Status known = check_parameters(uri, kKnown); !known.ok()) return known;
  SimOptions options;
  options.scene = uri.path;
  options.width = config.width;
  options.height = config.height;
  options.frame_rate = config.frame_rate;
  options.gain = config.gain;
  for (const auto& [name, value] : uri.parameters) {
    if (Status set = set_parameter(options, name, value); !set.ok()) return bad("sim: " + name + ": " + set.message());
  }
  for (const auto& [name, value] : uri.parameters) {
    if (name == "depth" && options.flicker.hz == 0)
      return bad("sim: depth=" + value + " requires flicker: add flicker=100hz");
  }
  if (!config.exposure_s.empty()) {
    if (!options.exposure_s.empty())
      return bad("sim: exposures are given in the URI and in camera.exposure_s: leave one of them out");
    options.exposure_s = config.exposure_s;
  }
  if (Status sane = check(options); !sane.ok()) return bad("sim: " + sane.message());
  return options;
}

}  // namespace lightwell
