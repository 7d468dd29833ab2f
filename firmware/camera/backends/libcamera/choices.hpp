// The options of the libcamera backend, and the choice of a camera's pixel format and of the values of its controls.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

#include "imaging/uri.hpp"

namespace lightwell::libcam {

/// The event that a camera's timestamp refers to.
enum class TimestampEvent : std::uint8_t {
  readout,   ///< The first row is read out (its exposure ends): drivers that stamp on arrival, CSI-2 and USB.
  exposure,  ///< The first row's exposure begins, as libcamera documents it.
};

struct LibcameraOptions {
  /// Ids or numbers as printed by `cam --list`, one per lens, in the order of the lenses.
  std::vector<std::string> cameras;
  int width = 640, height = 480;
  double frame_rate = 30;             ///< 1/s; 0: the camera's own.
  CaptureSettings capture;            ///< Without exposures: the camera's default. Colour gains of 1 if not set.
  std::optional<PixelFormat> format;  ///< Empty: the first supported one.
  Duration row_readout;               ///< Delay between successive rows; libcamera does not report it.
  TimestampEvent timestamp_event = TimestampEvent::readout;
  int control_delay = 3;           ///< Frames until a new exposure takes effect, if the camera does not report it.
  std::vector<std::string> notes;  ///< Former names of parameters in the URI.
};

/// invalid_argument names the parameter.
[[nodiscard]] Result<LibcameraOptions> parse_options(const CameraUri& uri, const CameraConfig& config);

/// A pixel format, named by DRM fourcc and modifier as in libcamera.
struct SupportedFormat {
  std::uint32_t fourcc = 0;
  std::uint64_t modifier = 0;  ///< Not zero: a packed, tiled or compressed layout of the vendor.
  std::string name;            ///< As printed by `cam --list`.
};

/// Empty if no PixelFormat has this memory layout. DRM names packed colours from the highest byte of a little-endian
/// word: its BGR888 is r, g, b in memory (rgb8), and its RGB888 is b, g, r, which is not supported.
[[nodiscard]] std::optional<PixelFormat> format_of(std::uint32_t fourcc, std::uint64_t modifier);

/// Index into `offered`: the wanted format; if `wanted` is empty, the first of nv12, yuyv, rgb8, then raw Bayer with
/// the most bits. failed_precondition lists the offered formats.
[[nodiscard]] Result<std::size_t> choose_format(std::span<const SupportedFormat> offered,
                                                std::optional<PixelFormat> wanted);

/// The range of a ControlInfo, in the control's own unit.
struct ControlRange {
  double min = 0, max = 0;
  std::optional<double> preset;  ///< Default of the camera, if it states one.
};

/// The controls of a camera that affect the meaning of pixel values. Empty or false: not offered.
struct SupportedControls {
  bool manual_exposure = false;             ///< AeEnable.
  bool manual_white_balance = false;        ///< AwbEnable.
  bool manual_focus = false;                ///< AfMode.
  std::optional<ControlRange> exposure_us;  ///< ExposureTime.
  std::optional<ControlRange> gain;         ///< AnalogueGain.
  std::optional<ControlRange> colour_gain;  ///< ColourGains, each of the two.
  std::optional<ControlRange> duration_us;  ///< FrameDurationLimits.
};

struct SelectedControls {
  bool manual_exposure = false, manual_white_balance = false, manual_focus = false;
  bool set_exposure = false;              ///< False: the camera has no ExposureTime, and exposure_us is an assumption.
  std::vector<std::int32_t> exposure_us;  ///< The exposure cycle, one entry or more.
  std::optional<float> gain;              ///< Empty: not offered.
  std::optional<std::array<float, 2>> colour_gains;
  std::optional<std::int64_t> duration_us;
  std::vector<std::string> notes;  ///< Requests that the camera cannot meet.

  [[nodiscard]] std::vector<double> exposure_s() const;
  /// Linear gain of frames whose metadata do not state it.
  [[nodiscard]] double assumed_gain() const { return gain ? static_cast<double>(*gain) : 1; }
};

/// Clamps values to their ranges and rounds exposures to the step of the range (the pipeline for USB cameras truncates
/// to 100 us). failed_precondition for a bracket on a camera whose exposure cannot be set.
[[nodiscard]] Result<SelectedControls> choose_controls(const SupportedControls& offered, const LibcameraOptions& asked);

}  // namespace lightwell::libcam
