// All differences between releases of libcamera from 0.0.3 (Debian 12) to 0.7; no other file here depends on a release.
//   0.1   generateConfiguration() takes a Span of roles, where 0.0.3 has a vector
//   0.5   AeEnable is an alias of ExposureTimeMode and AnalogueGainMode; a camera may offer these only
//   0.6   FrameBuffer::planes() is a Span by value, strings among controls are string_views, FrameStartup
//   0.7   Request::metadata() is const
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <libcamera/libcamera.h>
#include <libcamera/version.h>

#include "camera/backends/libcamera/choices.hpp"

namespace lightwell::libcam {

#define LIGHTWELL_LIBCAMERA_AT_LEAST(major, minor) \
  (LIBCAMERA_VERSION_MAJOR > (major) || (LIBCAMERA_VERSION_MAJOR == (major) && LIBCAMERA_VERSION_MINOR >= (minor)))

/// The value of a scalar control of any numeric type (the type of a limit differs between pipelines); otherwise empty.
[[nodiscard]] inline std::optional<double> number_of(const ::libcamera::ControlValue& value) {
  if (value.isNone() || value.isArray()) return std::nullopt;
  switch (value.type()) {
    case ::libcamera::ControlTypeByte:
      return value.get<std::uint8_t>();
    case ::libcamera::ControlTypeInteger32:
      return value.get<std::int32_t>();
    case ::libcamera::ControlTypeInteger64:
      return static_cast<double>(value.get<std::int64_t>());
    case ::libcamera::ControlTypeFloat:
      return static_cast<double>(value.get<float>());
    default:
      return std::nullopt;
  }
}

[[nodiscard]] inline bool offers(const ::libcamera::ControlInfoMap& map, const ::libcamera::ControlId& id) {
  return map.find(id.id()) != map.end();
}

[[nodiscard]] inline std::optional<ControlRange> range_of(const ::libcamera::ControlInfoMap& map,
                                                          const ::libcamera::ControlId& id) {
  const auto found = map.find(id.id());
  if (found == map.end()) return std::nullopt;
  const std::optional<double> min = number_of(found->second.min()), max = number_of(found->second.max());
  if (!min || !max) return std::nullopt;
  return ControlRange{*min, *max, number_of(found->second.def())};
}

/// Whether automatic exposure can be switched off.
[[nodiscard]] inline bool offers_manual_exposure(const ::libcamera::ControlInfoMap& map) {
#if LIGHTWELL_LIBCAMERA_AT_LEAST(0, 5)
  if (offers(map, ::libcamera::controls::ExposureTimeMode)) return true;
#endif
  return offers(map, ::libcamera::controls::AeEnable);
}

inline void set_manual_exposure(const ::libcamera::ControlInfoMap& map, ::libcamera::ControlList& list) {
  namespace controls = ::libcamera::controls;
#if LIGHTWELL_LIBCAMERA_AT_LEAST(0, 5)
  if (offers(map, controls::ExposureTimeMode))
    list.set(controls::ExposureTimeMode, static_cast<std::int32_t>(controls::ExposureTimeModeManual));
  if (offers(map, controls::AnalogueGainMode))
    list.set(controls::AnalogueGainMode, static_cast<std::int32_t>(controls::AnalogueGainModeManual));
#endif
  if (offers(map, controls::AeEnable)) list.set(controls::AeEnable, false);
}

/// Null if the camera has no stream for the role.
[[nodiscard]] inline std::unique_ptr<::libcamera::CameraConfiguration> configuration_for(::libcamera::Camera& camera,
                                                                                         ::libcamera::StreamRole role) {
  // A braced list fits both signatures.
  return camera.generateConfiguration({role});
}

/// A plane of a buffer; a copy, because newer releases return the planes by value.
struct BufferPlane {
  int fd = -1;
  std::size_t offset = 0, length = 0;
};
[[nodiscard]] inline std::vector<BufferPlane> planes_of(const ::libcamera::FrameBuffer& buffer) {
  std::vector<BufferPlane> planes;
  for (const ::libcamera::FrameBuffer::Plane& plane : buffer.planes()) {
    // Without an offset the plane begins at the start of its buffer.
    const bool whole = plane.offset == ::libcamera::FrameBuffer::Plane::kInvalidOffset;
    planes.push_back({plane.fd.get(), whole ? 0 : plane.offset, plane.length});
  }
  return planes;
}

/// The camera's model name, or its id if it has none.
[[nodiscard]] inline std::string model_of(const ::libcamera::Camera& camera) {
  const auto model = camera.properties().get(::libcamera::properties::Model);
  return model ? std::string(*model) : camera.id();
}

/// The release of the loaded library, which may differ from the one the program was built with.
[[nodiscard]] inline std::string release() { return ::libcamera::CameraManager::version(); }

}  // namespace lightwell::libcam
