#include "camera/backends/libcamera/choices.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include <lightwell/text.hpp>

#include "camera/uri_parameters.hpp"
#include "imaging/frame.hpp"

namespace lightwell::libcam {
namespace {

Status bad(const std::string& what) { return invalid_argument("libcamera: " + what); }

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
  if (key == "row_readout") return uri_row_readout(value).assign_to(options.row_readout).in("libcamera: row_readout");
  if (key == "control_delay")
    return uri_number<int>(value, 0, 30).assign_to(options.control_delay).in("libcamera: control_delay");
  // timestamp
  if (value != "readout" && value != "exposure") return bad("timestamp=" + value + " is neither readout nor exposure");
  options.timestamp_event = value == "readout" ? TimestampEvent::readout : TimestampEvent::exposure;
  return {};
}

Status set_cameras(LibcameraOptions& options, std::string_view path) {
  for (const std::string_view camera : separated(path, ',')) options.cameras.emplace_back(camera);
  if (options.cameras.size() > static_cast<std::size_t>(kMaxLenses))
    return bad(formatted("a rig has at most %d lenses, these are %zu cameras", kMaxLenses, options.cameras.size()));
  for (const std::string& camera : options.cameras)
    if (camera.empty())
      return bad(
          "no camera is named: write libcamera:ID, or libcamera:ID0,ID1 for two lenses, with ids from `cam --list`");
  if (options.cameras.size() == 2 && options.cameras[0] == options.cameras[1])
    return bad("camera '" + options.cameras[0] + "' cannot be both lenses");
  return {};
}

constexpr std::uint32_t fourcc_of(const char (&name)[5]) {
  std::uint32_t code = 0;
  for (int i = 0; i < 4; ++i) code |= static_cast<std::uint32_t>(static_cast<unsigned char>(name[i])) << (8 * i);
  return code;
}

/// In order of preference. Processed formats exist in any size; raw ones are used on request, or if there is no other.
constexpr std::array<std::pair<PixelFormat, std::uint32_t>, 6> kFormats{{
    {PixelFormat::nv12, fourcc_of("NV12")},
    {PixelFormat::yuyv, fourcc_of("YUYV")},
    {PixelFormat::rgb8, fourcc_of("BG24")},
    {PixelFormat::bayer_rggb12, fourcc_of("RG12")},
    {PixelFormat::bayer_rggb10, fourcc_of("RG10")},
    {PixelFormat::bayer_rggb8, fourcc_of("RGGB")},
}};

std::string text_of(double v) { return formatted("%.4g", v); }

bool usable(const std::optional<ControlRange>& range) {
  return range && std::isfinite(range->min) && std::isfinite(range->max) && range->min <= range->max && range->max > 0;
}

/// The largest usual step of drivers that divides all values of the range.
double exposure_step_us(const ControlRange& range) {
  constexpr double kUsbStep = 100;
  const auto whole = [](double v) { return std::fmod(v, kUsbStep) == 0; };
  return whole(range.min) && whole(range.max) && (!range.preset || whole(*range.preset)) ? kUsbStep : 1;
}

/// Clamps and rounds to the step of the range, at least one step.
double rounded_exposure_us(double us, const ControlRange& range) {
  const double step = exposure_step_us(range);
  const double low = std::ceil(std::max(range.min, step) / step) * step;
  const double high = std::max(low, std::floor(std::min(range.max, 2e9) / step) * step);
  return std::clamp(std::round(us / step) * step, low, high);
}

double interval_us(const LibcameraOptions& asked) { return asked.frame_rate > 0 ? 1e6 / asked.frame_rate : 1e6 / 30; }

/// Default exposure: the camera's default if it is shorter than the frame interval, otherwise half the frame interval.
double default_exposure_us(const SupportedControls& offered, const LibcameraOptions& asked) {
  const double half_us = interval_us(asked) / 2;
  if (usable(offered.exposure_us) && offered.exposure_us->preset && *offered.exposure_us->preset > 0)
    return std::min(*offered.exposure_us->preset, 2 * half_us);
  return std::min(10'000.0, half_us);
}

void choose_exposures(const SupportedControls& offered, const LibcameraOptions& asked, SelectedControls& chosen) {
  std::vector<double> wanted_us;
  for (const double s : asked.capture.exposure_s) wanted_us.push_back(1e6 * s);
  if (wanted_us.empty()) {
    wanted_us.push_back(default_exposure_us(offered, asked));
    chosen.notes.push_back("no exposure is set: one of " + text_of(wanted_us[0] / 1000) + " ms is held");
  }
  chosen.set_exposure = usable(offered.exposure_us);
  if (!chosen.set_exposure)
    chosen.notes.push_back("the camera offers no ExposureTime: it controls its exposure, and " +
                           text_of(wanted_us[0] / 1000) + " ms is assumed if it does not report one");
  for (const double us : wanted_us) {
    const double taken =
        chosen.set_exposure ? rounded_exposure_us(us, *offered.exposure_us) : std::clamp(std::round(us), 1.0, 2e9);
    if (std::abs(taken - us) > 0.001 * us && chosen.set_exposure)
      chosen.notes.push_back("exposure " + text_of(us / 1000) + " ms becomes " + text_of(taken / 1000) +
                             " ms: the camera offers " + text_of(offered.exposure_us->min / 1000) + " to " +
                             text_of(offered.exposure_us->max / 1000) + " ms in steps of " +
                             text_of(exposure_step_us(*offered.exposure_us) / 1000) + " ms");
    chosen.exposure_us.push_back(static_cast<std::int32_t>(taken));
  }
  chosen.manual_exposure = offered.manual_exposure;
  if (!offered.manual_exposure)
    chosen.notes.emplace_back("the camera offers no AeEnable: automatic exposure, if it has any, stays on");
}

void choose_gain(const SupportedControls& offered, const LibcameraOptions& asked, SelectedControls& chosen) {
  const double wanted = asked.capture.gain.value_or(1);
  if (!usable(offered.gain)) {
    chosen.notes.push_back("the camera offers no AnalogueGain: a gain of 1 is assumed" +
                           (wanted == 1 ? std::string() : ", not " + text_of(wanted)));
    return;
  }
  const double gain = std::clamp(wanted, offered.gain->min, offered.gain->max);
  chosen.gain = static_cast<float>(gain);
  if (std::abs(gain - wanted) > 0.001 * wanted)
    chosen.notes.push_back("gain " + text_of(wanted) + " becomes " + text_of(gain) + ": the camera offers " +
                           text_of(offered.gain->min) + " to " + text_of(offered.gain->max));
}

void choose_white(const SupportedControls& offered, const LibcameraOptions& asked, SelectedControls& chosen) {
  chosen.manual_white_balance = offered.manual_white_balance;
  if (!offered.manual_white_balance)
    chosen.notes.emplace_back("the camera offers no AwbEnable: automatic white balance, if it has any, stays on");
  if (!usable(offered.colour_gain)) {
    if (offered.manual_white_balance)
      chosen.notes.emplace_back("the camera offers no ColourGains: its colour gains are unknown");
    return;
  }
  // With gains of 1 no channel saturates before the sensor does.
  const std::array<double, 2> wanted = asked.capture.colour_gains.value_or(std::array<double, 2>{1, 1});
  std::array<float, 2> gains{};
  for (std::size_t i = 0; i < gains.size(); ++i) {
    const double gain = std::clamp(wanted[i], offered.colour_gain->min, offered.colour_gain->max);
    if (gain != wanted[i])
      chosen.notes.push_back(std::string(i == 0 ? "red" : "blue") + " gain " + text_of(wanted[i]) + " becomes " +
                             text_of(gain));
    gains[i] = static_cast<float>(gain);
  }
  chosen.colour_gains = gains;
}

void choose_duration(const SupportedControls& offered, const LibcameraOptions& asked, SelectedControls& chosen) {
  if (asked.frame_rate == 0) return;
  if (!usable(offered.duration_us)) {
    chosen.notes.emplace_back("the camera offers no FrameDurationLimits: its frame rate cannot be set");
    return;
  }
  // The frame duration must exceed the exposure by some rows.
  const auto longest = static_cast<double>(*std::max_element(chosen.exposure_us.begin(), chosen.exposure_us.end()));
  const double wanted = interval_us(asked), needed = std::max(wanted, 1.01 * longest);
  const double taken = std::clamp(needed, offered.duration_us->min, offered.duration_us->max);
  chosen.duration_us = static_cast<std::int64_t>(std::llround(taken));
  if (std::abs(taken - wanted) > 0.005 * wanted)
    chosen.notes.push_back("frame rate " + text_of(asked.frame_rate) + " becomes " + text_of(1e6 / taken) +
                           (needed > wanted ? ": an exposure lasts " + text_of(longest / 1000) + " ms"
                                            : ": the camera offers " + text_of(1e6 / offered.duration_us->max) +
                                                  " to " + text_of(1e6 / std::max(offered.duration_us->min, 1.0))));
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

std::optional<PixelFormat> format_of(std::uint32_t fourcc, std::uint64_t modifier) {
  if (modifier != 0) return std::nullopt;
  for (const auto& [format, code] : kFormats)
    if (code == fourcc) return format;
  return std::nullopt;
}

Result<std::size_t> choose_format(std::span<const SupportedFormat> offered, std::optional<PixelFormat> wanted) {
  for (const auto& entry : kFormats) {
    if (wanted && entry.first != *wanted) continue;
    for (std::size_t i = 0; i < offered.size(); ++i)
      if (format_of(offered[i].fourcc, offered[i].modifier) == entry.first) return i;
  }
  std::string list, known;
  for (const SupportedFormat& o : offered) {
    const std::optional<PixelFormat> ours = format_of(o.fourcc, o.modifier);
    list += (list.empty() ? "" : ", ") + o.name + (ours ? " (" + std::string(to_string(*ours)) + ")" : "");
  }
  for (const auto& entry : kFormats) known += (known.empty() ? "" : ", ") + std::string(to_string(entry.first));
  return Status(StatusCode::failed_precondition,
                (wanted ? "the camera does not offer " + std::string(to_string(*wanted))
                        : "the camera offers no format that Lightwell reads (" + known + ")") +
                    "; it offers: " + (list.empty() ? "nothing" : list));
}

std::vector<double> SelectedControls::exposure_s() const {
  std::vector<double> s;
  for (const std::int32_t us : exposure_us) s.push_back(1e-6 * us);
  return s;
}

Result<SelectedControls> choose_controls(const SupportedControls& offered, const LibcameraOptions& asked) {
  if (asked.capture.exposure_s.size() > 1 && !usable(offered.exposure_us))
    return Status(StatusCode::failed_precondition,
                  "the camera offers no ExposureTime, so a bracket is not possible: set only one exposure");
  SelectedControls chosen;
  choose_exposures(offered, asked, chosen);
  choose_gain(offered, asked, chosen);
  choose_white(offered, asked, chosen);
  choose_duration(offered, asked, chosen);
  chosen.manual_focus = offered.manual_focus;
  return chosen;
}

}  // namespace lightwell::libcam
