#include "camera/backends/depthai/depthai_backend.hpp"

#include <utility>

#include "camera/backends/depthai/depthai_device.hpp"
#include "camera/backends/depthai/oak_backend.hpp"

namespace lightwell {

Result<std::unique_ptr<CameraBackend>> make_depthai_backend(const CameraUri& uri, const CameraConfig& config) {
  Result<oak::OakOptions> options = oak::parse_options(uri, config);
  if (!options) return options.status();
  return std::unique_ptr<CameraBackend>(
      std::make_unique<oak::OakBackend>(std::move(*options), std::make_unique<oak::DepthaiDevice>()));
}

}  // namespace lightwell
