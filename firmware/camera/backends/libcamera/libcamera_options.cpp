#include "camera/backends/libcamera/libcamera_options.hpp"

#include <string_view>
#include <utility>

#include "camera/uri_parameters.hpp"
#include "imaging/frame.hpp"
#include "imaging/uri_values.hpp"

namespace lightwell::libcam {
namespace {

Status bad(const std::string& what) { return {StatusCode::invalid_argument, "libcamera: " + what}; }

/// Prepends the name of the parameter to an error.
Status named(const std::string& key, const Status& s) { return s.ok() ? s : bad(key + ": " + s.message()); }

Status set_format(LibcameraOptions& options, const std::string& value) {
  options.format = pixel_format_of(value);
  if (options.format && *options.format != PixelFormat::rgb_f32) return {};
  std::string known;
  for (const PixelFormat f : kPixelFormats)
    if (f != PixelFormat::rgb_f32) known += (known.empty() ? "" : ", ") + std::string(to_string(f));
  return bad("format=" + value + " is none of " + known);
}

Status set_parameter(LibcameraOptions& options, const std::string& key, const std::string& value) {
  if (key == "format") return set_format(options, value);
  if (key == "row_readout") return named(key, assign(options.row_readout, uri_row_readout(value)));
  if (key == "control_delay") return named(key, assign(options.control_delay, uri_number<int>(value, 0, 30)));
  // timestamp
  if (value != "readout" && value != "exposure") return bad("timestamp=" + value + " is neither readout nor exposure");
  options.timestamp_event = value == "readout" ? TimestampEvent::readout : TimestampEvent::exposure;
  return {};
}

Status set_cameras(LibcameraOptions& options, std::string_view path) {
  for (bool more = true; more;) {
    const std::size_t comma = path.find(',');
    more = comma != std::string_view::npos;
    options.cameras.emplace_back(path.substr(0, comma));
    if (more) path.remove_prefix(comma + 1);
  }
  if (options.cameras.size() > static_cast<std::size_t>(kMaxLenses))
    return bad("a rig has at most " + std::to_string(kMaxLenses) + " lenses, these are " +
               std::to_string(options.cameras.size()) + " cameras");
  for (const std::string& camera : options.cameras)
    if (camera.empty())
      return bad(
          "no camera is named: write libcamera:ID, or libcamera:ID0,ID1 for two lenses, with ids from `cam --list`");
  if (options.cameras.size() == 2 && options.cameras[0] == options.cameras[1])
    return bad("camera '" + options.cameras[0] + "' cannot be both lenses");
  return {};
}

}  // namespace

Result<LibcameraOptions> parse_options(const CameraUri& uri, const CameraConfig& config) {
  static const ParameterNames kNames = {
      .capture = {"exposure", "gain", "colour_gains"},
      .own = {"format", "row_readout", "timestamp", "control_delay"},
      .renamed = {
          {"readout", "row_readout"}, {"stamp", "timestamp"}, {"white", "colour_gains"}, {"settle", "control_delay"}}};
  Result<UriParameters> parameters = read_parameters(uri, config, kNames);
  if (!parameters) return parameters.status();
  LibcameraOptions options;
  options.capture = std::move(parameters->capture);
  options.notes = std::move(parameters->warnings);
  options.width = config.width;
  options.height = config.height;
  options.frame_rate = config.frame_rate;
  if (Status s = set_cameras(options, uri.path); !s.ok()) return s;
  for (const auto& [key, value] : parameters->own)
    if (Status s = set_parameter(options, key, value); !s.ok()) return s;
  if (options.width < 2 || options.height < 2 || options.width > 16384 || options.height > 16384)
    return bad("camera.width and camera.height: 2 to 16384 pixels");
  if (!(options.frame_rate >= 0 && options.frame_rate <= 1000))
    return bad("camera.frame_rate must lie between 0 (the camera's own) and 1000");
  return options;
}

}  // namespace lightwell::libcam
