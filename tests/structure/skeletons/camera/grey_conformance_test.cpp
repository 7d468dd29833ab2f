// The result of "A camera backend" in CONTRIBUTING.md. Step 1 is grey_backend; step 2 is the target of this test, with
// the backend in it; step 5 is the comment of make_grey_backend().
#include "app/component_tables.hpp"
#include "camera/conformance/conformance.hpp"
#include "structure/skeletons/camera/grey_backend.hpp"

namespace lightwell::conformance {
namespace {

// Step 3: the row of backend_table().
constexpr BackendEntry kRow{"grey", "grey:  grey frames", &make_grey_backend};

Result<std::unique_ptr<CameraBackend>> make_grey() {
  CameraConfig config;
  config.width = 64;
  config.height = 48;
  config.frame_rate = 100;
  return kRow.make(*parse_camera_uri("grey:"), config);
}

// Step 4: the conformance suite.
INSTANTIATE_TEST_SUITE_P(Grey, CameraConformance, cameras({{"grey", &make_grey}}), name_of);

}  // namespace
}  // namespace lightwell::conformance
