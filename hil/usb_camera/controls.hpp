// What a host reads and sets by class-specific requests (UVC 1.1): the controls of the camera terminal and the
// processing unit (4.2), and probe and commit, by which the stream's format is negotiated (4.3.1.1).
#pragma once

#include "usb_camera/descriptors.hpp"

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

/// Size of a payload header with presentation time and source clock (2.4.3.3).
inline constexpr std::size_t kPayloadHeader = 12;

/// The result of a commit.
struct NegotiatedFormat {
  StreamFormat format;
  std::uint32_t frame_bytes = 0;    ///< dwMaxVideoFrameSize.
  std::uint32_t payload_bytes = 0;  ///< dwMaxPayloadTransferSize, including the header.
};

class Negotiation {
 public:
  /// `payload_bytes`: size of a payload including its header; 0: one payload per frame, which costs the host least.
  explicit Negotiation(SupportedFormats formats, std::uint32_t payload_bytes = 0);

  /// Restores the initial state.
  void reset();

  /// Answers a request to the streaming interface. A probe for an unsupported format is answered with the nearest
  /// supported one; a commit of an unsupported format is out_of_range.
  [[nodiscard]] ControlReply request(std::uint8_t selector, ControlRequest request, std::span<const std::uint8_t> data);

  /// Returns the format of the latest commit once; std::nullopt without a new commit.
  [[nodiscard]] std::optional<NegotiatedFormat> take_commit();

  [[nodiscard]] const SupportedFormats& formats() const { return formats_; }

 private:
  struct Choice {
    std::uint8_t format = 1, frame = 1;  ///< Numbers of the descriptors.
    int rate = 30;
  };
  [[nodiscard]] Choice nearest(std::span<const std::uint8_t> data) const;
  [[nodiscard]] bool exactly(const Choice& choice, std::span<const std::uint8_t> data) const;
  [[nodiscard]] NegotiatedFormat negotiated_format(const Choice& choice) const;
  [[nodiscard]] Bytes written(const Choice& choice) const;

  SupportedFormats formats_;
  std::uint32_t payload_bytes_;
  Choice initial_, probe_, committed_;
  std::optional<NegotiatedFormat> commit_;
};

}  // namespace lightwell::usb_camera
