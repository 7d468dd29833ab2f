// Khronos' core validation layer below the layer: it checks what the layer passes on.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host_sdk/openxr_layer/layer_client.hpp"
#include "support/read_file.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kNobody = "LIGHTWELL_XR_PROBE=grpc://127.0.0.1:1";

TEST(LayerValidation, CallsOfTheLayerAreValid) {
  const TempDir folder;
  LayerSetup setup{.environment = {kNobody, "XR_CORE_VALIDATION_EXPORT_TYPE=text",
                                   "XR_CORE_VALIDATION_FILE_NAME=" + folder.path("validation.txt")}};
  ChildOptions options = layer_environment(folder, setup);
  for (std::string& variable : options.environment) {
    if (variable.starts_with("XR_ENABLE_API_LAYERS=")) variable += ":XR_APILAYER_LUNARG_core_validation";
    if (variable.starts_with("XR_API_LAYER_PATH=")) variable += ":" OPENXR_VALIDATION_MANIFESTS;
  }
  Child client(client_command({"--frames", "5", "--messages", "--cube", "8", "3", "1", "--sessions", "2"}), options);
  EXPECT_EQ(client.wait(), (ExitStatus{0, 0})) << client.out() << client.err();
  EXPECT_THAT(client.out(), HasSubstr("supported 1 1\ncreated 0\ncreated 0\nlight 0"));
  const std::string everything = client.out() + client.err() + read_file(folder.path("validation.txt"));
  EXPECT_THAT(everything, Not(HasSubstr("VUID")));
}

}  // namespace
}  // namespace lightwell::test
