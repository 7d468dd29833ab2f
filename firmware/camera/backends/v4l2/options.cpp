#include "camera/backends/v4l2/options.hpp"

#include <algorithm>
#include <utility>

#include <linux/videodev2.h>

#include "camera/backends/v4l2/exposure_schedule.hpp"
#include "camera/backends/v4l2/formats.hpp"
#include "camera/uri_parameters.hpp"
#include "imaging/uri_values.hpp"

namespace lightwell::v4l2 {
namespace {

constexpr double kMaxExposure_s = 60;

Status bad(const std::string& what) { return {StatusCode::invalid_argument, what}; }

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

Status set_parameter(Options& options, const std::string& name, const std::string& value) {
  if (name == "width") return assign(options.wanted.width, uri_number<int>(value, 2, 16384));
  if (name == "height") return assign(options.wanted.height, uri_number<int>(value, 2, 16384));
  if (name == "frame_rate") return assign(options.wanted.rate, uri_number<double>(value, 0.1, 1000));
  if (name == "format") return assign(options.wanted.format, format(value));
  // V4L2 does not define how a driver's gain values relate to linear gain.
  if (name == "gain_raw") return assign(options.gain_raw, uri_number<int>(value, -1000000, 1000000));
  if (name == "power_line") return assign(options.power_line, power_line(value));
  if (name == "control_delay")
    return assign(options.control_delay, uri_number<int>(value, 1, ExposureSchedule::kMaxDelay));
  return assign(options.row_readout, uri_row_readout(value));
}

}  // namespace

Result<Options> parse_options(const CameraUri& uri, const CameraConfig& config) {
  static const ParameterNames kNames = {
      .capture = {"exposure", "white_balance"},
      .own = {"width", "height", "frame_rate", "format", "gain_raw", "power_line", "row_readout", "control_delay"},
      .renamed = {{"fps", "frame_rate"}, {"gain", "gain_raw"}, {"readout", "row_readout"}}};
  Result<UriParameters> parameters = read_parameters(uri, config, kNames);
  if (!parameters) return parameters.status();
  Options options;
  options.capture = std::move(parameters->capture);
  options.notes = std::move(parameters->warnings);
  options.path = uri.path;
  if (options.path.empty()) return bad("v4l2: no device is named: write v4l2:/dev/video0");
  options.wanted.width = config.width;
  options.wanted.height = config.height;
  // In the configuration 0 means "on demand", which a live camera cannot do: keep the default rate.
  if (config.frame_rate > 0) options.wanted.rate = config.frame_rate;
  for (const auto& [name, value] : parameters->own)
    if (Status set = set_parameter(options, name, value); !set.ok()) return bad("v4l2: " + name + ": " + set.message());
  for (const double e : options.capture.exposure_s)
    if (e > kMaxExposure_s) return bad("v4l2: exposure: the longest is 60 s");
  return options;
}

}  // namespace lightwell::v4l2
