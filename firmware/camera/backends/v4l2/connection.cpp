#include "camera/backends/v4l2/connection.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <lightwell/text.hpp>

#include "camera/backend.hpp"
#include "camera/backends/v4l2/timing.hpp"
#include "camera/uri_parameters.hpp"

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
  if (name == "width") return uri_number<int>(value, 2, 16384).assign_to(options.wanted.width);
  if (name == "height") return uri_number<int>(value, 2, 16384).assign_to(options.wanted.height);
  if (name == "frame_rate") return uri_number<double>(value, 0.1, 1000).assign_to(options.wanted.rate);
  if (name == "format") return format(value).assign_to(options.wanted.format);
  // V4L2 does not define how a driver's gain values relate to linear gain.
  if (name == "gain_raw") return uri_number<int>(value, -1000000, 1000000).assign_to(options.gain_raw);
  if (name == "power_line") return power_line(value).assign_to(options.power_line);
  if (name == "control_delay")
    return uri_number<int>(value, 1, ExposureSchedule::kMaxDelay).assign_to(options.control_delay);
  return uri_row_readout(value).assign_to(options.row_readout);
}

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

std::string rate_text(double rate) { return formatted("%.4g", rate); }

void note_picture(const Options& options, const NegotiatedFormat& settled, const Layout& layout, bool copied,
                  std::vector<std::string>& notes) {
  const RequestedFormat& wanted = options.wanted;
  const Encoding& encoding = *settled.encoding;
  if (settled.width != wanted.width || settled.height != wanted.height)
    notes.push_back("pictures of " + size_text(settled.width, settled.height) + " in place of " +
                    size_text(wanted.width, wanted.height) + ", which the device does not have");
  if (settled.rate == 0) {
    notes.push_back("the device does not report its frame rate; " + rate_text(wanted.rate) +
                    " frames per second are assumed");
  } else if (std::abs(settled.rate - wanted.rate) > 0.01 * wanted.rate) {
    notes.push_back(rate_text(settled.rate) + " frames a second in place of " + rate_text(wanted.rate));
  }
  if (layout.view_offset > 0)
    notes.push_back("colours come in the order of " + fourcc_text(encoding.fourcc) + ": frames begin " +
                    std::to_string(encoding.skip_columns) + " column and " + std::to_string(encoding.skip_rows) +
                    " row further on, and are " + size_text(layout.view_width, layout.view_height) + " of " +
                    size_text(layout.width, layout.height));
  if (encoding.packing != Packing::none)
    notes.push_back(fourcc_text(encoding.fourcc) + " is converted to " + std::string(to_string(encoding.format)));
  if (copied) notes.emplace_back("the driver has too few buffers to lend them: frames are copied");
  // PixelFormat defines nv12 and yuyv as BT.601, limited range (lightwell/pixel.hpp).
  const bool ycbcr =
      encoding.packing == Packing::none && pixel_layout(encoding.format).sampling == ColorSampling::ycbcr;
  if (ycbcr && settled.quantization == V4L2_QUANTIZATION_FULL_RANGE)
    notes.emplace_back("the driver declares full range, but frames are read as limited range: calibrate the response");
  if (ycbcr && settled.ycbcr != V4L2_YCBCR_ENC_DEFAULT && settled.ycbcr != V4L2_YCBCR_ENC_601)
    notes.emplace_back("the driver declares another matrix than BT.601: colours are slightly wrong");
}

struct ControlSetting {
  std::uint32_t id = 0;
  const char* name = "";
  int value = 0;
  bool missed = false;  ///< Report its absence, because that affects the meaning of pixel values.
};

std::string milliseconds(double s) { return formatted("%.4g ms", s * 1e3); }

/// Sets a control and returns the value read back; empty if it cannot be set.
std::optional<int> set_and_read(Device& device, const Control& control, int value) {
  const int nearest = nearest_in(control.range, value);
  if (device.set_control(control.id, nearest) != 0) return std::nullopt;
  return device.control_value(control.id);
}

/// Switches automatic exposure off, by either of the two menu entries. False if it stays on.
bool make_manual(Device& device) {
  const std::optional<Control> mode = device.control(V4L2_CID_EXPOSURE_AUTO);
  if (!mode) return true;  // No automatic exposure.
  for (const int manual : {V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_SHUTTER_PRIORITY})
    if (device.set_control(mode->id, manual) == 0 && device.control_value(mode->id) == manual) return true;
  return false;
}

ExposureControl unknown_exposure(double rate) { return {std::nullopt, {}, {1 / (rate > 0 ? rate : 30)}}; }

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

void disable_auto_controls(Device& device, const Options& options, std::vector<std::string>& notes) {
  const double white_balance_k = options.capture.white_balance_k.value_or(CaptureSettings::kDefaultWhiteBalance_k);
  std::optional<Control> gain = device.control(V4L2_CID_GAIN);
  if (!gain) gain = device.control(V4L2_CID_ANALOGUE_GAIN);
  // In this order, because values can be set only when the automatic controls are off.
  const std::array wishes = {
      ControlSetting{V4L2_CID_AUTOGAIN, "automatic gain", 0, false},
      ControlSetting{V4L2_CID_AUTO_WHITE_BALANCE, "automatic white balance", 0, false},
      ControlSetting{V4L2_CID_FOCUS_AUTO, "automatic focus", 0, false},
      ControlSetting{V4L2_CID_EXPOSURE_AUTO_PRIORITY, "rate that follows exposure", 0, false},
      ControlSetting{V4L2_CID_BACKLIGHT_COMPENSATION, "backlight compensation", 0, false},
      ControlSetting{gain ? gain->id : V4L2_CID_GAIN, "gain", options.gain_raw.value_or(gain ? gain->range.min : 0),
                     true},
      ControlSetting{V4L2_CID_WHITE_BALANCE_TEMPERATURE, "white balance",
                     static_cast<int>(std::lround(white_balance_k)), true},
      ControlSetting{V4L2_CID_POWER_LINE_FREQUENCY, "power-line filter", options.power_line, false},
  };
  std::vector<std::string> in_force, missing, refused;
  for (const ControlSetting& wish : wishes) {
    const std::optional<Control> control = device.control(wish.id);
    if (!control) {
      if (wish.missed) missing.emplace_back(wish.name);
      continue;
    }
    const std::optional<int> now = set_and_read(device, *control, wish.value);
    if (!now) {
      refused.emplace_back(wish.name);
      continue;
    }
    in_force.push_back(std::string(wish.name) + " " + std::to_string(*now) +
                       (*now == wish.value ? "" : " (asked for " + std::to_string(wish.value) + ")"));
  }
  if (!in_force.empty()) notes.push_back("in force, read back: " + joined(in_force));
  if (!missing.empty()) notes.push_back("the device has no control of: " + joined(missing));
  if (!refused.empty()) notes.push_back("the device does not let these be set: " + joined(refused));
}

Result<ExposureControl> configure_exposure(Device& device, const Options& options, double rate,
                                           std::vector<std::string>& notes) {
  const std::vector<double>& exposure_s = options.capture.exposure_s;
  const bool manual = make_manual(device);
  const std::optional<Control> control = device.control(V4L2_CID_EXPOSURE_ABSOLUTE);
  if (!control || !manual) {
    const std::string why =
        manual ? "the device has no control of exposure in units of time" : "automatic exposure cannot be switched off";
    if (exposure_s.size() > 1)
      return Status(StatusCode::invalid_argument,
                    "v4l2: '" + options.path + "': " + why + ", so there is no bracket: leave exposure out");
    notes.push_back(why + ": frames report the frame interval as an assumption");
    return unknown_exposure(rate);
  }

  ExposureControl exposure{control, {}, {}};
  const auto take = [&](int code) {
    exposure.codes.push_back(code);
    exposure.seconds.push_back(code * kExposureUnit_s);
  };
  if (exposure_s.empty()) {
    const std::optional<int> now = device.control_value(control->id);
    if (now && *now > 0) take(*now);
  }
  for (const double wanted : exposure_s) {
    const std::optional<int> now =
        set_and_read(device, *control, static_cast<int>(std::lround(wanted / kExposureUnit_s)));
    if (!now || *now <= 0) break;
    take(*now);
    if (std::abs(exposure.seconds.back() - wanted) > 0.05 * wanted)
      notes.push_back("exposure " + milliseconds(exposure.seconds.back()) + " in place of " + milliseconds(wanted) +
                      ", which the device does not support");
  }
  if (exposure.codes.size() < std::max<std::size_t>(exposure_s.size(), 1))
    return Status(StatusCode::internal,
                  "v4l2: '" + options.path + "': the device refuses to set the exposure, or does not report it");
  if (exposure_s.size() > 1 &&
      std::ranges::count(exposure.codes, exposure.codes.front()) == static_cast<std::ptrdiff_t>(exposure.codes.size()))
    notes.emplace_back("all exposures of the bracket are the same to the device");
  const double longest = *std::ranges::max_element(exposure.seconds);
  if (rate > 0 && longest > 1 / rate)
    notes.push_back("exposure " + milliseconds(longest) +
                    " is longer than the frame interval: the frame rate may decrease");
  if (const int failed = device.set_control(control->id, exposure.codes.front()); failed != 0)
    return device.error("takes no exposure", failed);
  return exposure;
}

Result<Connection> connect(const Options& options, std::vector<std::string>& notes) {
  Result<Device> device = Device::open(options.path);
  if (!device) return device.status();
  const Result<SelectedMode> choice = choose_mode(device->modes(options.wanted), options.wanted);
  if (!choice) return choice.status();
  const Result<NegotiatedFormat> settled = device->set_mode(*choice);
  if (!settled) return settled.status();
  std::vector<std::string> of_controls;
  disable_auto_controls(*device, options, of_controls);
  Result<ExposureControl> exposure = configure_exposure(*device, options, settled->rate, of_controls);
  if (!exposure) return exposure.status();

  const bool ours = settled->encoding->packing == Packing::none;
  const int to_lend = required_buffer_count(static_cast<int>(exposure->seconds.size()));
  const int wanted_buffers = kMinQueuedBuffers + (ours ? to_lend : 1);
  Result<MappedBuffers> buffers = device->map_buffers(wanted_buffers);
  if (!buffers) return buffers.status();
  const int given = static_cast<int>(buffers->all().size());
  if (given < 2)
    return Status(StatusCode::resource_exhausted, "v4l2: '" + options.path + "' gives " + std::to_string(given) +
                                                      " buffers, and streaming takes two: ask for a smaller size");
  const bool lends = ours && given >= wanted_buffers;
  const Result<Layout> layout = layout_of(*settled->encoding, settled->width, settled->height, settled->bytes_per_line,
                                          settled->size_image, ours && !lends);
  if (!layout) return layout.status();
  for (const MappedBuffers::Buffer& buffer : buffers->all())
    if (buffer.memory.size() < layout->bytes)
      return Status(StatusCode::internal,
                    "v4l2: '" + options.path + "': the driver's buffers are smaller than its pictures");
  note_picture(options, *settled, *layout, ours && !lends, notes);
  if (!device->stamps_are_monotonic())
    notes.emplace_back("the driver's timestamps are of an unknown clock: the time of arrival is used instead");
  notes.insert(notes.end(), of_controls.begin(), of_controls.end());
  return Connection{std::move(*device),   settled->encoding,   *layout, settled->rate,
                    std::move(*exposure), std::move(*buffers), lends};
}

}  // namespace lightwell::v4l2
