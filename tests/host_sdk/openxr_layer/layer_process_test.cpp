// Whole processes: how the loader finds the layer, its configuration, and what reaches the runtime.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host_sdk/openxr_layer/layer_client.hpp"
#include "support/read_file.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kNobody = "LIGHTWELL_XR_PROBE=grpc://127.0.0.1:1";

class LayerProcess : public ::testing::Test {
 protected:
  struct Outcome {
    ExitStatus exit_status;
    std::string out, err;
  };
  Outcome run(const std::vector<std::string>& arguments, const LayerSetup& setup) const {
    Child client(client_command(arguments), layer_environment(folder_, setup));
    const ExitStatus exit_status = client.wait();
    return {exit_status, client.out(), client.err()};
  }
  /// The calls that reach the runtime.
  std::string trace(const std::vector<std::string>& arguments, LayerSetup setup, const std::string& name) const {
    setup.environment.push_back("SIMULATED_XR_TRACE=" + folder_.path(name));
    const Outcome o = run(arguments, setup);
    EXPECT_EQ(o.exit_status, (ExitStatus{0, 0})) << o.out << o.err;
    return read_file(folder_.path(name));
  }

  TempDir folder_;
};

TEST_F(LayerProcess, ChangesNothingForAnApplicationWithoutTheExtension) {
  const std::vector<std::string> plain = {"--frames", "20", "--plain", "--sessions", "2", "--instances", "2"};
  const std::string without = trace(plain, {.kind = LayerKind::none}, "without");
  const std::string with = trace(plain, {.environment = {kNobody}}, "with");
  EXPECT_THAT(without, HasSubstr("xrCreateInstance XR_MND_headless\n"));
  EXPECT_EQ(occurrences(without, "xrWaitFrame\n"), 40U);
  EXPECT_EQ(with, without);
}

TEST_F(LayerProcess, RemovesItsExtensionsAndAddsTheConversionOfTimes) {
  const std::string calls = trace({"--frames", "2"}, {.environment = {kNobody}}, "calls");
  EXPECT_THAT(calls, HasSubstr("xrCreateInstance XR_MND_headless XR_KHR_convert_timespec_time\n"));
  EXPECT_THAT(calls, HasSubstr("xrLocateSpace\n"));
  const std::string lacking =
      trace({"--frames", "2"}, {.environment = {kNobody, "SIMULATED_XR_LACKS=timespec"}}, "lacking");
  EXPECT_THAT(lacking, HasSubstr("xrCreateInstance XR_MND_headless\n"));
}

TEST_F(LayerProcess, TheImplicitLayerIsThereWhereAProbeIsNamed) {
  const LayerKind implicit = LayerKind::implicit_layer;
  EXPECT_THAT(run({}, {implicit, {kNobody}}).out, HasSubstr("listed 1 1\nsupported 1 1\ncreated 0\n"));
  EXPECT_THAT(run({}, {implicit, {}}).out, HasSubstr("listed 0 0\n"));
  EXPECT_THAT(run({}, {implicit, {kNobody, "LIGHTWELL_XR_DISABLE=1"}}).out, HasSubstr("listed 0 0\n"));
}

TEST_F(LayerProcess, WithoutAProbeLightEstimationIsNotSupported) {
  const Outcome o = run({"--sessions", "3"}, {});
  // XR_ERROR_FEATURE_UNSUPPORTED.
  EXPECT_THAT(o.out, HasSubstr("listed 1 1\nsupported 0 0\ncreated -8\n"));
  EXPECT_EQ(o.exit_status, (ExitStatus{0, 0}));
  EXPECT_EQ(o.err,
            "XR_APILAYER_LIGHTWELL_light_estimation: xrCreateLightEstimatorANDROID: LIGHTWELL_XR_PROBE is not "
            "set: set it to the address of a probe, such as grpc://probe.local:7420\n");
}

TEST_F(LayerProcess, AWrongConfigurationIsNotSupportedAndIsNamed) {
  const struct {
    const char *variable, *allowed;
  } cases[] = {{"LIGHTWELL_XR_SPACE=room", "it is local, stage or view"},
               {"LIGHTWELL_XR_POSE=0,1,2", "it is x,y,z,qx,qy,qz,qw"},
               {"LIGHTWELL_XR_POSE=0,1,2,0,0,0,2", "a quaternion of length 1"},
               {"LIGHTWELL_XR_POSE=0,1,2,0,0,0,1,5", "it is x,y,z"},
               {"LIGHTWELL_XR_POSE=nan,1,2,0,0,0,1", "it is x,y,z"},
               {"LIGHTWELL_XR_POSE=0,1,2,0,0,0,1e999", "it is x,y,z"},
               {"LIGHTWELL_XR_SCALE=0", "it is a number from 1e-9 to 1e9"},
               {"LIGHTWELL_XR_SCALE=1x", "it is a number"}};
  for (const auto& c : cases) {
    const Outcome o = run({}, {.environment = {kNobody, c.variable}});
    EXPECT_THAT(o.out, HasSubstr("supported 0 0\ncreated -8\n")) << c.variable;
    EXPECT_THAT(o.err, HasSubstr(c.variable));
    EXPECT_THAT(o.err, HasSubstr(c.allowed));
  }
  EXPECT_THAT(run({}, {.environment = {kNobody, "LIGHTWELL_XR_POSE=0,1,-2e0,0,0,0.7071,0.7071"}}).out,
              HasSubstr("supported 1 1\ncreated 0\n"));
}

TEST_F(LayerProcess, ASpaceThatTheRuntimeLacksIsNamed) {
  const Outcome o = run({}, {.environment = {kNobody, "LIGHTWELL_XR_SPACE=stage", "SIMULATED_XR_LACKS=stage"}});
  // XR_ERROR_RUNTIME_FAILURE.
  EXPECT_THAT(o.out, HasSubstr("supported 1 1\ncreated -2\n"));
  EXPECT_THAT(o.err, HasSubstr("LIGHTWELL_XR_SPACE=stage: the runtime has no such space"));
}

}  // namespace
}  // namespace lightwell::test
