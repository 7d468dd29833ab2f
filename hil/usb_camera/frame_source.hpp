// Where pictures come from: what the camera's streaming side asks, and scene_source.hpp answers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <lightwell/result.hpp>

#include "usb_camera/controls.hpp"
#include "usb_camera/supported_formats.hpp"

namespace lightwell::usb_camera {

/// The bytes of one frame, never written to again.
using Picture = std::shared_ptr<const std::vector<std::byte>>;

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// Pictures of this format from now on.
  [[nodiscard]] virtual Status configure(const StreamFormat& format) = 0;
  /// What automatic exposure chooses at gain 1. Known without a format.
  [[nodiscard]] virtual double automatic_exposure_s() const = 0;
  /// From the end of the first row's exposure to the end of the last row's, in the format configured.
  [[nodiscard]] virtual double readout_s() const = 0;
  /// The picture of a frame, or nothing while it is not ready: then it has been ordered, before all others.
  [[nodiscard]] virtual Picture picture(std::uint64_t number, const SensorSettings& settings) = 0;
  /// It will be wanted soon.
  virtual void order(std::uint64_t number, const SensorSettings& settings) = 0;
};

}  // namespace lightwell::usb_camera
