// The camera's controls: what a host may ask and set of the camera terminal and the processing unit (UVC 1.1, 4.2).
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

/// What VC_REQUEST_ERROR_CODE_CONTROL answers after a stall (4.2.1.2).
enum class RequestError : std::uint8_t {
  none = 0,
  not_ready = 1,
  wrong_state = 2,  ///< An automatic has the control.
  out_of_range = 4,
  invalid_unit = 5,
  invalid_control = 6,
  invalid_request = 7,
};

/// Bytes for the host, or a stall and the reason for it.
struct ControlReply {
  RequestError error = RequestError::none;
  Bytes data;

  [[nodiscard]] bool ok() const { return error == RequestError::none; }
};

/// What a frame is exposed with.
struct SensorSettings {
  double exposure_s = 0.01;
  double gain = 1;    ///< Linear.
  int kelvin = 6500;  ///< White of this colour comes out grey.
  friend bool operator==(const SensorSettings&, const SensorSettings&) = default;
};

/// The scene's own white, for which the sensor's channels are equal.
inline constexpr int kNeutralKelvin = 6500;

/// bmControls of a unit's descriptor.
[[nodiscard]] std::uint32_t control_bitmap(std::uint8_t unit);

/// Values as at power-on: exposure and white balance automatic, gain 1, no filter against flicker.
///
///   unit                 control                    value            unit of the value
///   camera terminal      auto-exposure mode         1 manual, 8 by aperture (automatic)
///                        exposure time, absolute    1 to 10000       100 us
///   processing unit      gain                       100 to 400       1/100; libcamera 0.0.3 takes it for 1 to 4, too
///                        white balance temperature  2800 to 8000     kelvin, in steps of 10
///                        white balance automatic    0, 1
///                        power line frequency       0 off, 1 50 Hz, 2 60 Hz: whole half periods of automatic exposures
///
/// A value that an automatic has cannot be set (wrong_state). Reading it tells what the automatic chose.
class Controls {
 public:
  Controls();

  /// As at power-on. The automatic's exposure stays.
  void reset();

  /// `length` is how many bytes the host takes or gives. A unit without controls is invalid_unit.
  [[nodiscard]] ControlReply request(std::uint8_t unit, std::uint8_t selector, ControlRequest request,
                                     std::span<const std::uint8_t> data);

  /// What automatic exposure chooses at gain 1, and the longest exposure that it allows itself.
  void set_automatic(double exposure_s, double longest_s);

  [[nodiscard]] SensorSettings settings() const;
  /// How often a value was set.
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
