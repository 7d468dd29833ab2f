#include "camera/backends/sim/sim_options.hpp"

#include <numbers>
#include <utility>

#include "camera/uri_parameters.hpp"
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

}  // namespace lightwell
