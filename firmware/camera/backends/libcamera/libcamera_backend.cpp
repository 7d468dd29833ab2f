#include "camera/backends/libcamera/libcamera_backend.hpp"

#include <string>
#include <utility>
#include <vector>

#include "camera/backends/libcamera/lens_backend.hpp"
#include "camera/backends/libcamera/lens_stream.hpp"

namespace lightwell {

Result<std::unique_ptr<CameraBackend>> make_libcamera_backend(const CameraUri& uri, const CameraConfig& config) {
  using namespace libcam;
  Result<LibcameraOptions> options = parse_options(uri, config);
  if (!options) return options.status();
  auto mailbox = std::make_shared<Mailbox>();
  std::vector<std::unique_ptr<Lens>> lenses;
  for (const std::string& name : options->cameras)
    lenses.push_back(std::make_unique<LensStream>(name, static_cast<int>(lenses.size()), mailbox));
  return std::unique_ptr<CameraBackend>(
      std::make_unique<LensBackend>(std::move(*options), std::move(lenses), std::move(mailbox)));
}

}  // namespace lightwell
