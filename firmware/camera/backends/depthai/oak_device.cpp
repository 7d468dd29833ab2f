#include "camera/backends/depthai/oak_device.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <lightwell/text.hpp>

#include "camera/uri_parameters.hpp"
#include "imaging/pixel_layout.hpp"

namespace lightwell::oak {
namespace {

// Limits of CameraControl::setManualExposure() and setManualWhiteBalance() in depthai-core's documentation.
constexpr double kMinIso = 100, kMaxIso = 1600;
constexpr int kMaxWhiteBalance_k = 12'000;
constexpr double kDefault_us = 8000;

Status bad(const std::string& what) { return invalid_argument("depthai: " + what); }

std::string text_of(double v) { return formatted("%.4g", v); }

Status set_parameter(OakOptions& options, const std::string& key, const std::string& value) {
  if (key == "socket") {
    if (value.size() != 1 || value[0] < 'A' || value[0] > 'J') return bad("socket=" + value + ": a letter, A to J");
    options.socket = value[0];
    return {};
  }
  if (key == "format") {
    const std::optional<PixelFormat> format = pixel_format_of(value);
    if (format != PixelFormat::nv12 && format != PixelFormat::bayer_rggb10)
      return bad("format=" + value + " is neither nv12 nor bayer10");
    options.format = *format;
    return {};
  }
  return uri_row_readout(value).assign_to(options.row_readout).in("depthai: row_readout");
}

void hold_exposures(OakOptions& options, const std::vector<double>& exposure_s) {
  const double longest = 1e6 / options.frame_rate;
  std::vector<double> asked_us;
  for (const double s : exposure_s) asked_us.push_back(1e6 * s);
  if (asked_us.empty()) {
    asked_us.push_back(std::min(kDefault_us, longest));
    options.notes.push_back("no exposure is set: one of " + text_of(asked_us[0] / 1000) + " ms is held");
  }
  for (const double us : asked_us) {
    const double taken = std::clamp(std::round(us), 1.0, std::floor(longest));
    if (std::abs(taken - us) > 0.001 * us)
      options.notes.push_back("exposure " + text_of(us / 1000) + " ms becomes " + text_of(taken / 1000) +
                              " ms: up to " + text_of(longest / 1000) + " ms can be asked for at this rate");
    options.exposure_us.push_back(static_cast<std::uint32_t>(taken));
  }
}

}  // namespace

Result<OakOptions> parse_options(const CameraUri& uri, const CameraConfig& config) {
  static const ParameterNames kNames = {.capture = {"exposure", "gain", "white_balance"},
                                        .own = {"socket", "format", "row_readout"},
                                        .renamed = {{"readout", "row_readout"}, {"white", "white_balance"}}};
  Result<UriParameters> parameters = read_parameters(uri, config, kNames);
  if (!parameters) return parameters.status();
  const CaptureSettings& capture = parameters->capture;
  OakOptions options;
  options.notes = std::move(parameters->warnings);
  options.id = uri.path;
  if (options.id.empty()) return bad("no camera is named: write depthai:MXID, with the id from depthai's device list");
  options.width = config.width;
  options.height = config.height;
  options.frame_rate = config.frame_rate;
  for (const auto& [key, value] : parameters->own)
    if (Status s = set_parameter(options, key, value); !s.ok()) return s;
  if (options.width < 2 || options.height < 2 || options.width > 16384 || options.height > 16384 ||
      options.width % 4 != 0 || options.height % 2 != 0)
    return bad("camera.width and camera.height: up to 16384, the width a multiple of 4, the height of 2");
  if (!(options.frame_rate >= 1 && options.frame_rate <= 240))
    return bad("camera.frame_rate must lie between 1 and 240");
  options.white_balance_k = static_cast<int>(std::lround(capture.white_balance_k.value_or(options.white_balance_k)));
  if (options.white_balance_k > kMaxWhiteBalance_k)
    return bad("white_balance: " + std::to_string(options.white_balance_k) + " K; the camera takes 1000K to 12000K");
  const double gain = capture.gain.value_or(1);
  const double iso = std::clamp(std::round(100 * gain), kMinIso, kMaxIso);
  options.iso = static_cast<std::uint32_t>(iso);
  if (std::abs(iso - 100 * gain) > gain)
    options.notes.push_back("gain " + text_of(gain) + " becomes " + text_of(options.gain()) +
                            ": the camera takes 1 to 16");
  hold_exposures(options, capture.exposure_s);
  return options;
}

std::optional<ProbeTime> mid_exposure(const OakPicture& picture, Duration row_readout, ProbeTime now) {
  constexpr Duration kMaxAge = Duration::from_seconds(5);
  const ProbeTime stamp{picture.timestamp_ns};
  if (stamp > now || now - stamp > kMaxAge) return std::nullopt;
  const Duration half_exposure{std::int64_t{500} * picture.exposure_us};
  return stamp - half_exposure + Duration{row_readout.ns * picture.height / 2};
}

Status unpack_raw10(const OakPicture& picture, std::span<std::uint16_t> words) {
  const auto width = static_cast<std::size_t>(picture.width), height = static_cast<std::size_t>(picture.height);
  if (width == 0 || height == 0 || width % 4 != 0 || picture.stride < width / 4 * 5)
    return {StatusCode::data_loss, "raw rows of " + std::to_string(picture.stride) + " bytes do not hold " +
                                       std::to_string(width) + " pixels of 10 bits"};
  if (picture.data.size() < picture.stride * (height - 1) + width / 4 * 5 || words.size() < width * height)
    return {StatusCode::data_loss, "the raw picture is cut off"};
  for (std::size_t row = 0; row < height; ++row)
    unpack10(picture.data.subspan(row * picture.stride), words.subspan(row * width, width));
  return {};
}

}  // namespace lightwell::oak
