#include "camera/backends/v4l2/controls.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <lightwell/text.hpp>

namespace lightwell::v4l2 {
namespace {

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

}  // namespace lightwell::v4l2
