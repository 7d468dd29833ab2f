// Interface through which the stream gets its images; scene_source.hpp implements it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <lightwell/result.hpp>

#include "usb_camera/controls.hpp"
#include "usb_camera/supported_formats.hpp"

namespace lightwell::usb_camera {

/// The immutable bytes of one frame.
using Picture = std::shared_ptr<const std::vector<std::byte>>;

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// Sets the format of the images from now on.
  [[nodiscard]] virtual Status configure(const StreamFormat& format) = 0;
  /// Automatic exposure time at gain 1 in seconds. Does not need configure().
  [[nodiscard]] virtual double automatic_exposure_s() const = 0;
  /// From the end of the first row's exposure to the end of the last row's, in the format configured.
  [[nodiscard]] virtual double readout_s() const = 0;
  /// The image of a frame, or nullptr while it is not ready; it is then queued for rendering before all others.
  [[nodiscard]] virtual Picture picture(std::uint64_t number, const SensorSettings& settings) = 0;
  /// Queues an image that will be needed soon.
  virtual void order(std::uint64_t number, const SensorSettings& settings) = 0;
};

}  // namespace lightwell::usb_camera
