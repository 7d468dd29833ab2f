#include "camera/backends/sim/sim_options.hpp"

#include <charconv>
#include <cmath>
#include <numbers>
#include <span>

#include "camera/frame.hpp"

namespace lightwell {

namespace {

struct Unit {
  std::string_view suffix;
  double factor;
};

Status bad(const std::string& what) { return {StatusCode::invalid_argument, what}; }

/// A number and one of the suffixes.
Result<double> quantity(std::string_view text, std::span<const Unit> units) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string_view suffix(end, static_cast<std::size_t>(text.data() + text.size() - end));
  std::string known;
  for (const Unit& unit : units) {
    if (error == std::errc() && std::isfinite(number) && suffix == unit.suffix)
      return number * unit.factor;
    if (!unit.suffix.empty()) known += (known.empty() ? "" : ", ") + std::string(unit.suffix);
  }
  return bad("'" + std::string(text) + "' is no number with one of the units " + known);
}

Result<std::uint64_t> whole_number(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size())
    return bad("'" + std::string(text) + "' is no whole number");
  return number;
}

Result<double> plain_number(std::string_view text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number))
    return bad("'" + std::string(text) + "' is no number");
  return number;
}

/// Durations between commas.
Result<std::vector<double>> exposures(std::string_view text) {
  std::vector<double> all;
  for (bool more = true; more;) {
    const std::size_t comma = text.find(',');
    more = comma != std::string_view::npos;
    const Result<double> one = parse_duration_s(text.substr(0, comma));
    if (!one) return one.status();
    all.push_back(*one);
    if (more) text.remove_prefix(comma + 1);
  }
  return all;
}

template <class T>
Status assign(T& target, Result<T> value) {
  if (!value) return value.status();
  target = std::move(*value);
  return {};
}

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
    for (const PixelFormat f : kPixelFormats)
      known += (known.empty() ? "" : ", ") + std::string(to_string(f));
    return bad("'" + value + "' is none of " + known);
  }
  if (name == "turn") return assign(options.turn_rad_per_s, parse_turn_rad_per_s(value));
  if (name == "switch") return assign(options.switch_s, parse_duration_s(value));
  if (name == "readout") return assign(options.readout_s, parse_duration_s(value));
  if (name == "exposure") return assign(options.exposure_s, exposures(value));
  if (name == "flicker") return assign(options.flicker.hz, parse_frequency_hz(value));
  if (name == "depth") return assign(options.flicker.depth, plain_number(value));
  if (name == "ring") return assign(options.ring, whole_number(value));
  return assign(options.seed, whole_number(value));
}

Status check(const SimOptions& options) {
  if (options.exposure_s.size() > static_cast<std::size_t>(kMaxBracket))
    return bad("a bracket has at most " + std::to_string(kMaxBracket) + " exposures");
  for (const double e : options.exposure_s) {
    if (!(e > 0) || !std::isfinite(e)) return bad("exposures must be above zero");
  }
  if (!(options.gain > 0) || !std::isfinite(options.gain)) return bad("gain must be above zero");
  if (!(options.frame_rate >= 0 && options.frame_rate <= 10000))
    return bad("frame_rate must lie between 0 (as fast as frames are taken) and 10000");
  if (options.ring < 1 || options.ring > 100000) return bad("ring must lie between 1 and 100000");
  if (!(options.flicker.depth >= 0 && options.flicker.depth <= 1)) return bad("depth must lie between 0 and 1");
  if (options.flicker.hz > 0 && options.frame_rate == 0)
    return bad("flicker needs frames at known times: camera.frame_rate must be above 0");
  return {};
}

}  // namespace

Result<double> parse_duration_s(std::string_view text) {
  static constexpr Unit kUnits[] = {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"", 1}};
  Result<double> seconds = quantity(text, kUnits);
  if (seconds && *seconds < 0) return bad("'" + std::string(text) + "' is negative");
  return seconds;
}

Result<double> parse_frequency_hz(std::string_view text) {
  static constexpr Unit kUnits[] = {{"hz", 1}, {"Hz", 1}, {"", 1}};
  Result<double> hz = quantity(text, kUnits);
  if (hz && !(*hz > 0 && *hz <= 1000)) return bad("'" + std::string(text) + "' does not lie between 0 and 1000 Hz");
  return hz;
}

Result<double> parse_turn_rad_per_s(std::string_view text) {
  constexpr double kDegree = std::numbers::pi / 180;
  static constexpr Unit kUnits[] = {{"deg/s", kDegree}, {"rad/s", 1}, {"", kDegree}};
  return quantity(text, kUnits);
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
    if (Status set = set_parameter(options, name, value); !set.ok())
      return bad("sim: " + name + ": " + set.message());
  }
  for (const auto& [name, value] : uri.parameters) {
    if (name == "depth" && options.flicker.hz == 0)
      return bad("sim: depth=" + value + " is of a flicker: add flicker=100hz");
  }
  if (!config.exposure_s.empty()) {
    if (!options.exposure_s.empty())
      return bad("sim: exposures are given in the URI and in camera.exposure_s: which?");
    options.exposure_s = config.exposure_s;
  }
  if (Status sane = check(options); !sane.ok()) return bad("sim: " + sane.message());
  return options;
}

}  // namespace lightwell
