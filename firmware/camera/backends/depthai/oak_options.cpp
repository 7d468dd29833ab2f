#include "camera/backends/depthai/oak_options.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "camera/bracket_cycle.hpp"
#include "imaging/uri_values.hpp"

namespace lightwell::oak {
namespace {

// Limits of CameraControl::setManualExposure() and setManualWhiteBalance() in depthai-core's documentation.
constexpr double kMinIso = 100, kMaxIso = 1600;
constexpr double kMinWhiteBalance_k = 1000, kMaxWhiteBalance_k = 12'000;
constexpr double kDefault_us = 8000;

Status bad(const std::string& what) { return {StatusCode::invalid_argument, "depthai: " + what}; }

std::string text_of(double v) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", v);
  return text.data();
}

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
  if (key == "white") {
    const Result<double> kelvin = uri_quantity(value, {{"K", 1}});
    if (!kelvin || *kelvin < kMinWhiteBalance_k || *kelvin > kMaxWhiteBalance_k)
      return bad("white=" + value + ": a colour temperature, 1000K to 12000K");
    options.white_balance_k = static_cast<int>(std::lround(*kelvin));
    return {};
  }
  const Status readout = assign(options.row_readout, uri_row_readout(value));
  return readout.ok() ? readout : bad("readout: " + readout.message());
}

void hold_exposures(OakOptions& options, const CameraConfig& config) {
  const double longest = 1e6 / options.frame_rate;
  std::vector<double> asked_us;
  for (const double s : config.exposure_s) asked_us.push_back(1e6 * s);
  if (asked_us.empty()) {
    asked_us.push_back(std::min(kDefault_us, longest));
    options.notes.push_back("no camera.exposure_s is set: an exposure of " + text_of(asked_us[0] / 1000) +
                            " ms is held");
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

std::vector<double> OakOptions::exposure_s() const {
  std::vector<double> s;
  for (const std::uint32_t us : exposure_us) s.push_back(1e-6 * us);
  return s;
}

Result<OakOptions> parse_options(const CameraUri& uri, const CameraConfig& config) {
  if (Status s = check_parameters(uri, {"socket", "format", "white", "readout"}); !s.ok()) return s;
  OakOptions options;
  options.id = uri.path;
  if (options.id.empty()) return bad("no camera is named: write depthai:MXID, with the id from depthai's device list");
  options.width = config.width;
  options.height = config.height;
  options.frame_rate = config.frame_rate;
  for (const auto& [key, value] : uri.parameters)
    if (Status s = set_parameter(options, key, value); !s.ok()) return s;
  if (options.width < 2 || options.height < 2 || options.width > 16384 || options.height > 16384 ||
      options.width % 4 != 0 || options.height % 2 != 0)
    return bad("camera.width and camera.height: up to 16384, the width a multiple of 4, the height of 2");
  if (!(options.frame_rate >= 1 && options.frame_rate <= 240))
    return bad("camera.frame_rate must lie between 1 and 240");
  if (!(config.gain > 0) || !std::isfinite(config.gain)) return bad("camera.gain must be above zero");
  if (!config.exposure_s.empty())
    if (const Status s = check_exposures(config.exposure_s); !s.ok()) return bad("camera." + s.message());
  const double iso = std::clamp(std::round(100 * config.gain), kMinIso, kMaxIso);
  options.iso = static_cast<std::uint32_t>(iso);
  if (std::abs(iso - 100 * config.gain) > config.gain)
    options.notes.push_back("gain " + text_of(config.gain) + " becomes " + text_of(options.gain()) +
                            ": the camera takes 1 to 16");
  hold_exposures(options, config);
  return options;
}

}  // namespace lightwell::oak
