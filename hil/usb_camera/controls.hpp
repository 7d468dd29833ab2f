// The controls of the camera terminal and the processing unit, which a host reads and sets (UVC 1.1, 4.2).
//   ControlRequest, ControlReply, RequestError     control_bitmap()     Controls
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "usb_camera/little_endian.hpp"

namespace lightwell::usb_camera {

/// Class-specific requests, table A-8.
enum class ControlRequest : std::uint8_t {
  set_cur = 0x01,
  get_cur = 0x81,
  get_min = 0x82,
  get_max = 0x83,
  get_res = 0x84,
  get_len = 0x85,
  get_info = 0x86,
  get_def = 0x87,
};

/// Values of VC_REQUEST_ERROR_CODE_CONTROL after a stall (4.2.1.2).
enum class RequestError : std::uint8_t {
  none = 0,
  not_ready = 1,
  wrong_state = 2,  ///< The control is in automatic mode.
  out_of_range = 4,
  invalid_unit = 5,
  invalid_control = 6,
  invalid_request = 7,
};

/// Response data, or the reason for a stall.
struct ControlReply {
  RequestError error = RequestError::none;
  Bytes data;

  [[nodiscard]] bool ok() const { return error == RequestError::none; }
};

/// Sensor settings of one frame.
struct SensorSettings {
  double exposure_s = 0.01;
  double gain = 1;    ///< Linear.
  int kelvin = 6500;  ///< White balance: a black body of this temperature appears grey.
  friend bool operator==(const SensorSettings&, const SensorSettings&) = default;
};

/// Neutral white balance: no gains are applied to the sensor's channels.
inline constexpr int kNeutralKelvin = 6500;

/// bmControls of a unit's descriptor.
[[nodiscard]] std::uint32_t control_bitmap(std::uint8_t unit);

/// State of all controls. Initially exposure and white balance are automatic, gain is 1, and flicker is not avoided.
///
///   unit                 control                    value            unit of the value
///   camera terminal      auto-exposure mode         1 manual, 8 by aperture (automatic)
///                        exposure time, absolute    1 to 10000       100 us
///   processing unit      gain                       100 to 400       1/100; libcamera 0.0.3 also maps it to 1 to 4
///                        white balance temperature  2800 to 8000     kelvin, in steps of 10
///                        white balance automatic    0, 1
///                        power line frequency       0 off, 1 50 Hz, 2 60 Hz: whole half periods of automatic exposures
///
/// A control in automatic mode cannot be set (wrong_state); reading it returns the automatically chosen value.
class Controls {
 public:
  Controls();

  /// Restores the initial values. The value of set_automatic() stays.
  void reset();

  /// Answers a class-specific request; `data`: the value of set_cur. A unit without controls is invalid_unit.
  [[nodiscard]] ControlReply request(std::uint8_t unit, std::uint8_t selector, ControlRequest request,
                                     std::span<const std::uint8_t> data);

  /// The automatic exposure time at gain 1, and its maximum, both in seconds.
  void set_automatic(double exposure_s, double longest_s);

  [[nodiscard]] SensorSettings settings() const;
  /// Number of successful set_cur requests.
  [[nodiscard]] std::uint64_t sets() const { return sets_; }

 private:
  [[nodiscard]] bool automatic(std::size_t control) const;
  [[nodiscard]] std::uint32_t current(std::size_t control) const;
  [[nodiscard]] double automatic_exposure_s() const;
  [[nodiscard]] RequestError set(std::size_t control, std::span<const std::uint8_t> data);

  std::array<std::uint32_t, 6> values_{};
  double automatic_s_ = 0.01, longest_s_ = 1;
  std::uint64_t sets_ = 0;
};

}  // namespace lightwell::usb_camera
