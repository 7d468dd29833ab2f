#include "camera/backends/v4l2/options.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include <linux/videodev2.h>

#include "camera/backends/v4l2/exposure_schedule.hpp"
#include "camera/backends/v4l2/formats.hpp"
#include "camera/frame.hpp"

namespace lightwell::v4l2 {
namespace {

Status bad(const std::string& what) { return {StatusCode::invalid_argument, what}; }

template <class T>
Result<T> number(std::string_view text, T least, T most) {
  T value{};
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  // Written so that NaN is refused, too.
  if (error == std::errc() && stop == end && value >= least && value <= most) return value;
  return bad("'" + std::string(text) + "' is no number from " + std::to_string(least) + " to " + std::to_string(most));
}

/// "1.5ms", "200us", "0.01s"; a bare number is seconds.
Result<double> duration_s(std::string_view text) {
  static constexpr std::array<std::pair<std::string_view, double>, 3> kUnits = {{{"ms", 1e-3}, {"us", 1e-6}, {"s", 1}}};
  double factor = 1;
  std::string_view digits = text;
  for (const auto& [unit, seconds] : kUnits) {
    if (!digits.ends_with(unit)) continue;
    digits.remove_suffix(unit.size());
    factor = seconds;
    break;
  }
  const Result<double> value = number<double>(digits, 0, 1e9);
  const double seconds = value ? *value * factor : 0;
  if (!(seconds > 0 && seconds <= 60))
    return bad("'" + std::string(text) + "' is no duration above 0 and up to 60 s; write 0.5ms, 200us or 0.01s");
  return seconds;
}

Result<std::vector<double>> durations_s(std::string_view text) {
  std::vector<double> all;
  for (bool more = true; more;) {
    const std::size_t comma = text.find(',');
    more = comma != std::string_view::npos;
    const Result<double> one = duration_s(text.substr(0, comma));
    if (!one) return one.status();
    all.push_back(*one);
    if (more) text.remove_prefix(comma + 1);
  }
  return all;
}

Result<int> power_line(std::string_view text) {
  if (text == "off") return int{V4L2_CID_POWER_LINE_FREQUENCY_DISABLED};
  if (text == "50hz") return int{V4L2_CID_POWER_LINE_FREQUENCY_50HZ};
  if (text == "60hz") return int{V4L2_CID_POWER_LINE_FREQUENCY_60HZ};
  return bad("'" + std::string(text) + "' is none of off, 50hz, 60hz");
}

Result<std::string> format(const std::string& text) {
  if (std::ranges::find(encodings(), text, &Encoding::name) != encodings().end()) return text;
  return bad("'" + text + "' is none of " + format_names());
}

template <class T, class U>
Status assign(T& target, Result<U> value) {
  if (!value) return value.status();
  target = std::move(*value);
  return {};
}

Status set_parameter(Options& options, const std::string& name, const std::string& value) {
  if (name == "width") return assign(options.wanted.width, number<int>(value, 2, 16384));
  if (name == "height") return assign(options.wanted.height, number<int>(value, 2, 16384));
  if (name == "fps") return assign(options.wanted.rate, number<double>(value, 0.1, 1000));
  if (name == "format") return assign(options.wanted.format, format(value));
  if (name == "exposure") return assign(options.exposure_s, durations_s(value));
  if (name == "gain") return assign(options.gain, number<int>(value, -1000000, 1000000));
  if (name == "white_balance") return assign(options.white_balance_kelvin, number<int>(value, 1000, 20000));
  if (name == "power_line") return assign(options.power_line, power_line(value));
  if (name == "control_delay") return assign(options.control_delay, number<int>(value, 1, ExposureSchedule::kMaxDelay));
  Result<double> microseconds = number<double>(value, 0, 10000);
  if (microseconds) *microseconds *= 1e-6;
  return assign(options.row_readout_s, std::move(microseconds));
}

}  // namespace

Result<Options> parse_options(const CameraUri& uri, const CameraConfig& config) {
  static const std::vector<std::string_view> kKnown = {"width",          "height",       "fps",           "format",
                                                       "exposure",       "gain",         "white_balance", "power_line",
                                                       "row_readout_us", "control_delay"};
  if (Status known = check_parameters(uri, kKnown); !known.ok()) return known;
  Options options;
  options.path = uri.path;
  if (options.path.empty()) return bad("v4l2: which device? write v4l2:/dev/video0");
  options.wanted.width = config.width;
  options.wanted.height = config.height;
  // 0 means "as fast as frames are taken" elsewhere; a camera has a rate.
  if (config.frame_rate > 0) options.wanted.rate = config.frame_rate;
  for (const auto& [name, value] : uri.parameters)
    if (Status set = set_parameter(options, name, value); !set.ok()) return bad("v4l2: " + name + ": " + set.message());
  if (!config.exposure_s.empty()) {
    if (!options.exposure_s.empty())
      return bad("v4l2: exposures are given in the URI and in camera.exposure_s: which?");
    options.exposure_s = config.exposure_s;
  }
  if (options.exposure_s.size() > static_cast<std::size_t>(kMaxBracket))
    return bad("v4l2: a bracket has at most " + std::to_string(kMaxBracket) + " exposures");
  for (const double e : options.exposure_s)
    if (!(e > 0 && e <= 60)) return bad("v4l2: exposures must lie above 0 and up to 60 s");
  // How a driver's gain numbers relate to light, V4L2 does not say.
  if (config.gain != 1)
    return bad(
        "v4l2: camera.gain is linear, and V4L2's gain has no unit: leave it at 1, and say the device's own number "
        "in the URI with gain=");
  return options;
}

}  // namespace lightwell::v4l2
