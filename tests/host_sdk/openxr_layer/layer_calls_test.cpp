// The layer's functions in this process, through Debian's loader. No probe answers, so that every
// estimate is INVALID; estimates of a probe: tests/e2e/openxr_layer_test.cpp. Lightwell's archives are not linked,
// because the layer loads liblightwell.so.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host_sdk/openxr_layer/android_light_estimation.h"
#include "host_sdk/openxr_layer/xr_structure.hpp"

namespace {

using ::testing::ElementsAre;

constexpr const char* kLight = XR_ANDROID_LIGHT_ESTIMATION_EXTENSION_NAME;
constexpr const char* kCube = XR_ANDROID_LIGHT_ESTIMATION_CUBEMAP_EXTENSION_NAME;
/// A time of the simulated runtime.
constexpr XrTime kTime = 5'000'000'000'000'000'000 + 1;

using lightwell::test::structure;

template <class Function>
Function function(XrInstance instance, const char* name) {
  PFN_xrVoidFunction out = nullptr;
  if (XR_FAILED(xrGetInstanceProcAddr(instance, name, &out))) return nullptr;
  return reinterpret_cast<Function>(out);
}

XrResult create_instance(std::vector<const char*> extensions, XrInstance& out) {
  extensions.push_back(XR_MND_HEADLESS_EXTENSION_NAME);
  auto info = structure<XrInstanceCreateInfo>(XR_TYPE_INSTANCE_CREATE_INFO);
  std::string("calls").copy(info.applicationInfo.applicationName, XR_MAX_APPLICATION_NAME_SIZE - 1);
  info.applicationInfo.apiVersion = XR_CURRENT_API_VERSION;
  info.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  info.enabledExtensionNames = extensions.data();
  return xrCreateInstance(&info, &out);
}

class LayerCalls : public ::testing::Test {
 protected:
  /// An instance with `extensions`, a session and a space.
  void start(const std::vector<const char*>& extensions = {kLight, kCube}) {
    ASSERT_EQ(create_instance(extensions, instance_), XR_SUCCESS);
    auto get = structure<XrSystemGetInfo>(XR_TYPE_SYSTEM_GET_INFO);
    get.formFactor = XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY;
    ASSERT_EQ(xrGetSystem(instance_, &get, &system_), XR_SUCCESS);
    session_ = new_session();
    space_ = new_space(session_);
    create_ = function<PFN_xrCreateLightEstimatorANDROID>(instance_, "xrCreateLightEstimatorANDROID");
    destroy_ = function<PFN_xrDestroyLightEstimatorANDROID>(instance_, "xrDestroyLightEstimatorANDROID");
    get_ = function<PFN_xrGetLightEstimateANDROID>(instance_, "xrGetLightEstimateANDROID");
  }
  void TearDown() override {
    if (instance_ == XR_NULL_HANDLE) return;
    if (session_ != XR_NULL_HANDLE) {
      EXPECT_EQ(xrDestroySession(session_), XR_SUCCESS);
    }
    EXPECT_EQ(xrDestroyInstance(instance_), XR_SUCCESS);
  }

  [[nodiscard]] XrSession new_session() const {
    auto info = structure<XrSessionCreateInfo>(XR_TYPE_SESSION_CREATE_INFO);
    info.systemId = system_;
    XrSession out = XR_NULL_HANDLE;
    EXPECT_EQ(xrCreateSession(instance_, &info, &out), XR_SUCCESS);
    return out;
  }
  static XrSpace new_space(XrSession session) {
    auto info = structure<XrReferenceSpaceCreateInfo>(XR_TYPE_REFERENCE_SPACE_CREATE_INFO);
    info.referenceSpaceType = XR_REFERENCE_SPACE_TYPE_LOCAL;
    info.poseInReferenceSpace.orientation.w = 1;
    XrSpace out = XR_NULL_HANDLE;
    EXPECT_EQ(xrCreateReferenceSpace(session, &info, &out), XR_SUCCESS);
    return out;
  }
  [[nodiscard]] XrLightEstimatorANDROID new_estimator(XrSession session, void* next = nullptr) const {
    auto info = structure<XrLightEstimatorCreateInfoANDROID>(XR_TYPE_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID, next);
    XrLightEstimatorANDROID out = XR_NULL_HANDLE;
    EXPECT_EQ(create_(session, &info, &out), XR_SUCCESS);
    return out;
  }
  [[nodiscard]] XrLightEstimateGetInfoANDROID request() const {
    auto out = structure<XrLightEstimateGetInfoANDROID>(XR_TYPE_LIGHT_ESTIMATE_GET_INFO_ANDROID);
    out.space = space_;
    out.time = kTime;
    return out;
  }
  /// The result for an estimate with the chain `next`.
  XrResult result_of(XrLightEstimatorANDROID estimator, void* next = nullptr) const {
    const auto input = request();
    auto output = structure<XrLightEstimateANDROID>(XR_TYPE_LIGHT_ESTIMATE_ANDROID, next);
    return get_(estimator, &input, &output);
  }

  XrInstance instance_ = XR_NULL_HANDLE;
  XrSystemId system_ = XR_NULL_SYSTEM_ID;
  XrSession session_ = XR_NULL_HANDLE;
  XrSpace space_ = XR_NULL_HANDLE;
  PFN_xrCreateLightEstimatorANDROID create_ = nullptr;
  PFN_xrDestroyLightEstimatorANDROID destroy_ = nullptr;
  PFN_xrGetLightEstimateANDROID get_ = nullptr;
};

// The numbers of the registry, from sources that share nothing with android_light_estimation.h: PyPI's
// pyopenxr 1.1.6501 (xr/enums.py, generated from Khronos' xr.xml) for extension 701; for 722 the table of
// https://developer.android.com/develop/xr/openxr/extensions/XR_ANDROID_light_estimation_cubemap and the rule of the
// OpenXR style guide, 1000000000 + (extension - 1) * 1000 + offset.
TEST(Declarations, HaveTheNumbersOfTheRegistry) {
  const std::vector<int> types = {XR_TYPE_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID,
                                  XR_TYPE_LIGHT_ESTIMATE_GET_INFO_ANDROID,
                                  XR_TYPE_LIGHT_ESTIMATE_ANDROID,
                                  XR_TYPE_DIRECTIONAL_LIGHT_ANDROID,
                                  XR_TYPE_SPHERICAL_HARMONICS_ANDROID,
                                  XR_TYPE_AMBIENT_LIGHT_ANDROID,
                                  XR_TYPE_SYSTEM_LIGHT_ESTIMATION_PROPERTIES_ANDROID};
  for (std::size_t i = 0; i < types.size(); ++i) EXPECT_EQ(types[i], 1'000'000'000 + 700 * 1000 + static_cast<int>(i));
  const std::vector<int> cube = {XR_TYPE_SYSTEM_CUBEMAP_LIGHT_ESTIMATION_PROPERTIES_ANDROID,
                                 XR_TYPE_CUBEMAP_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID,
                                 XR_TYPE_CUBEMAP_LIGHTING_DATA_ANDROID};
  for (std::size_t i = 0; i < cube.size(); ++i) EXPECT_EQ(cube[i], 1'000'000'000 + 721 * 1000 + static_cast<int>(i));
  EXPECT_EQ(XR_LIGHT_ESTIMATE_STATE_VALID_ANDROID, 0);
  EXPECT_EQ(XR_LIGHT_ESTIMATE_STATE_INVALID_ANDROID, 1);
  EXPECT_EQ(XR_SPHERICAL_HARMONICS_KIND_TOTAL_ANDROID, 0);
  EXPECT_EQ(XR_SPHERICAL_HARMONICS_KIND_AMBIENT_ANDROID, 1);
  EXPECT_EQ(XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R32G32B32_SFLOAT_ANDROID, 1);
  EXPECT_EQ(XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R32G32B32A32_SFLOAT_ANDROID, 2);
  EXPECT_EQ(XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R16G16B16A16_SFLOAT_ANDROID, 3);
}

// Sizes and offsets on 64-bit machines of the members that follow `type` and `next`.
TEST(Declarations, HaveTheLayoutOfTheRegistry) {
  EXPECT_EQ(offsetof(XrLightEstimateGetInfoANDROID, time), 24U);
  EXPECT_EQ(offsetof(XrLightEstimateANDROID, lastUpdatedTime), 24U);
  EXPECT_EQ(offsetof(XrDirectionalLightANDROID, direction), 32U);
  EXPECT_EQ(offsetof(XrAmbientLightANDROID, colorCorrection), 32U);
  EXPECT_EQ(offsetof(XrSphericalHarmonicsANDROID, coefficients), 24U);
  EXPECT_EQ(sizeof(XrSphericalHarmonicsANDROID), 136U);
  EXPECT_EQ(offsetof(XrCubemapLightEstimatorCreateInfoANDROID, reproject), 24U);
  EXPECT_EQ(offsetof(XrCubemapLightingDataANDROID, imageBufferRight), 24U);
  EXPECT_EQ(offsetof(XrCubemapLightingDataANDROID, rotation), 72U);
  EXPECT_EQ(offsetof(XrCubemapLightingDataANDROID, centerExposureTime), 88U);
}

TEST_F(LayerCalls, FunctionsAreThoseOfTheEnabledExtensions) {
  const std::vector<const char*> light = {"xrCreateLightEstimatorANDROID", "xrDestroyLightEstimatorANDROID",
                                          "xrGetLightEstimateANDROID"};
  const std::vector<const char*> cube = {"xrEnumerateCubemapLightingResolutionsANDROID",
                                         "xrEnumerateCubemapLightingColorFormatsANDROID"};
  const struct {
    std::vector<const char*> extensions;
    bool light, cube;
  } cases[] = {{{}, false, false}, {{kLight}, true, false}, {{kLight, kCube}, true, true}};
  for (const auto& c : cases) {
    XrInstance instance = XR_NULL_HANDLE;
    ASSERT_EQ(create_instance(c.extensions, instance), XR_SUCCESS);
    for (const char* name : light) EXPECT_EQ(function<void (*)()>(instance, name) != nullptr, c.light) << name;
    for (const char* name : cube) EXPECT_EQ(function<void (*)()>(instance, name) != nullptr, c.cube) << name;
    EXPECT_EQ(xrDestroyInstance(instance), XR_SUCCESS);
  }
}

TEST_F(LayerCalls, TheCubemapExtensionNeedsTheOtherOne) {
  XrInstance instance = XR_NULL_HANDLE;
  EXPECT_EQ(create_instance({kCube}, instance), XR_ERROR_VALIDATION_FAILURE);
}

TEST_F(LayerCalls, TheSystemSupportsBoth) {
  start();
  auto cube = structure<XrSystemCubemapLightEstimationPropertiesANDROID>(
      XR_TYPE_SYSTEM_CUBEMAP_LIGHT_ESTIMATION_PROPERTIES_ANDROID);
  auto unknown = structure<XrBaseOutStructure>(static_cast<XrStructureType>(1'999'999'999));
  unknown.next = reinterpret_cast<XrBaseOutStructure*>(&cube);
  auto light =
      structure<XrSystemLightEstimationPropertiesANDROID>(XR_TYPE_SYSTEM_LIGHT_ESTIMATION_PROPERTIES_ANDROID, &unknown);
  auto properties = structure<XrSystemProperties>(XR_TYPE_SYSTEM_PROPERTIES, &light);
  EXPECT_EQ(xrGetSystemProperties(instance_, system_, &properties), XR_SUCCESS);
  EXPECT_STREQ(properties.systemName, "simulated headset");
  EXPECT_EQ(light.supportsLightEstimation, XR_TRUE);
  EXPECT_EQ(cube.supportsCubemapLightEstimation, XR_TRUE);
  EXPECT_EQ(xrGetSystemProperties(instance_, system_ + 1, &properties), XR_ERROR_SYSTEM_INVALID);
}

TEST_F(LayerCalls, AnEstimateWithoutAChainHasAState) {
  start();
  const XrLightEstimatorANDROID estimator = new_estimator(session_);
  const auto input = request();
  auto output = structure<XrLightEstimateANDROID>(XR_TYPE_LIGHT_ESTIMATE_ANDROID);
  EXPECT_EQ(get_(estimator, &input, &output), XR_SUCCESS);
  EXPECT_EQ(output.state, XR_LIGHT_ESTIMATE_STATE_INVALID_ANDROID);
}

TEST_F(LayerCalls, EveryChainedPartHasAState) {
  start();
  const XrLightEstimatorANDROID estimator = new_estimator(session_);
  auto directional = structure<XrDirectionalLightANDROID>(XR_TYPE_DIRECTIONAL_LIGHT_ANDROID);
  auto ambient = structure<XrAmbientLightANDROID>(XR_TYPE_AMBIENT_LIGHT_ANDROID, &directional);
  auto unknown = structure<XrBaseOutStructure>(static_cast<XrStructureType>(1'999'999'999));
  unknown.next = reinterpret_cast<XrBaseOutStructure*>(&ambient);
  auto harmonics = structure<XrSphericalHarmonicsANDROID>(XR_TYPE_SPHERICAL_HARMONICS_ANDROID, &unknown);
  EXPECT_EQ(result_of(estimator, &harmonics), XR_SUCCESS);
  EXPECT_EQ(directional.state, XR_LIGHT_ESTIMATE_STATE_INVALID_ANDROID);
  EXPECT_EQ(ambient.state, XR_LIGHT_ESTIMATE_STATE_INVALID_ANDROID);
  EXPECT_EQ(harmonics.state, XR_LIGHT_ESTIMATE_STATE_INVALID_ANDROID);
}

TEST_F(LayerCalls, TwoStructuresOfOneTypeAreRefused) {
  start();
  const XrLightEstimatorANDROID estimator = new_estimator(session_);
  auto total = structure<XrSphericalHarmonicsANDROID>(XR_TYPE_SPHERICAL_HARMONICS_ANDROID);
  auto ambient = structure<XrSphericalHarmonicsANDROID>(XR_TYPE_SPHERICAL_HARMONICS_ANDROID, &total);
  ambient.kind = XR_SPHERICAL_HARMONICS_KIND_AMBIENT_ANDROID;
  EXPECT_EQ(result_of(estimator, &ambient), XR_ERROR_VALIDATION_FAILURE);
  EXPECT_EQ(result_of(estimator, &total), XR_SUCCESS);
}

TEST_F(LayerCalls, AnUnknownKindAndALoopAreRefused) {
  start();
  const XrLightEstimatorANDROID estimator = new_estimator(session_);
  auto harmonics = structure<XrSphericalHarmonicsANDROID>(XR_TYPE_SPHERICAL_HARMONICS_ANDROID);
  harmonics.kind = static_cast<XrSphericalHarmonicsKindANDROID>(2);
  EXPECT_EQ(result_of(estimator, &harmonics), XR_ERROR_VALIDATION_FAILURE);
  auto unknown = structure<XrBaseOutStructure>(static_cast<XrStructureType>(1'999'999'999));
  unknown.next = &unknown;
  EXPECT_EQ(result_of(estimator, &unknown), XR_ERROR_VALIDATION_FAILURE);
}

TEST_F(LayerCalls, NullAndWrongTypesAreRefused) {
  start();
  const XrLightEstimatorANDROID estimator = new_estimator(session_);
  const auto input = request();
  auto output = structure<XrLightEstimateANDROID>(XR_TYPE_LIGHT_ESTIMATE_ANDROID);
  EXPECT_EQ(get_(estimator, nullptr, &output), XR_ERROR_VALIDATION_FAILURE);
  EXPECT_EQ(get_(estimator, &input, nullptr), XR_ERROR_VALIDATION_FAILURE);
  auto other_input = input;
  other_input.type = XR_TYPE_SPACE_LOCATION;
  EXPECT_EQ(get_(estimator, &other_input, &output), XR_ERROR_VALIDATION_FAILURE);
  auto other_output = output;
  other_output.type = XR_TYPE_DIRECTIONAL_LIGHT_ANDROID;
  EXPECT_EQ(get_(estimator, &input, &other_output), XR_ERROR_VALIDATION_FAILURE);

  auto info = structure<XrLightEstimatorCreateInfoANDROID>(XR_TYPE_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID);
  XrLightEstimatorANDROID created = XR_NULL_HANDLE;
  EXPECT_EQ(create_(session_, nullptr, &created), XR_ERROR_VALIDATION_FAILURE);
  EXPECT_EQ(create_(session_, &info, nullptr), XR_ERROR_VALIDATION_FAILURE);
  info.type = XR_TYPE_SPACE_LOCATION;
  EXPECT_EQ(create_(session_, &info, &created), XR_ERROR_VALIDATION_FAILURE);
}

TEST_F(LayerCalls, HandlesThatDoNotExistAreRefused) {
  start();
  auto info = structure<XrLightEstimatorCreateInfoANDROID>(XR_TYPE_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID);
  XrLightEstimatorANDROID created = XR_NULL_HANDLE;
  EXPECT_EQ(create_(XR_NULL_HANDLE, &info, &created), XR_ERROR_HANDLE_INVALID);
  EXPECT_EQ(create_(reinterpret_cast<XrSession>(std::uintptr_t{0x1234}), &info, &created), XR_ERROR_HANDLE_INVALID);
  EXPECT_EQ(destroy_(XR_NULL_HANDLE), XR_ERROR_HANDLE_INVALID);
  EXPECT_EQ(result_of(XR_NULL_HANDLE), XR_ERROR_HANDLE_INVALID);
}

TEST_F(LayerCalls, ADestroyedEstimatorIsRefused) {
  start();
  const XrLightEstimatorANDROID estimator = new_estimator(session_);
  EXPECT_EQ(destroy_(estimator), XR_SUCCESS);
  EXPECT_EQ(destroy_(estimator), XR_ERROR_HANDLE_INVALID);
  const XrLightEstimatorANDROID next = new_estimator(session_);
  EXPECT_NE(next, estimator);
  EXPECT_EQ(result_of(estimator), XR_ERROR_HANDLE_INVALID);
  EXPECT_EQ(result_of(next), XR_SUCCESS);
}

TEST_F(LayerCalls, ASessionDestroysItsEstimatorsAndNoOthers) {
  start();
  const XrSession other = new_session();
  const XrLightEstimatorANDROID estimator = new_estimator(session_), of_other = new_estimator(other);
  EXPECT_EQ(result_of(of_other), XR_SUCCESS);
  EXPECT_EQ(xrDestroySession(other), XR_SUCCESS);
  EXPECT_EQ(result_of(of_other), XR_ERROR_HANDLE_INVALID);
  EXPECT_EQ(result_of(estimator), XR_SUCCESS);
}

TEST_F(LayerCalls, ErrorsOfTheRuntimeAboutSpaceAndTimeAreReturned) {
  start();
  const XrLightEstimatorANDROID estimator = new_estimator(session_);
  auto output = structure<XrLightEstimateANDROID>(XR_TYPE_LIGHT_ESTIMATE_ANDROID);
  for (const XrTime time : {XrTime{0}, XrTime{-1}, XrTime{1}}) {
    auto input = request();
    input.time = time;
    EXPECT_EQ(get_(estimator, &input, &output), XR_ERROR_TIME_INVALID) << time;
  }
  EXPECT_EQ(xrDestroySpace(space_), XR_SUCCESS);
  EXPECT_EQ(result_of(estimator), XR_ERROR_HANDLE_INVALID);
}

TEST_F(LayerCalls, CubeMapsAreOfferedByTheTwoCallIdiom) {
  start();
  const auto resolutions = function<PFN_xrEnumerateCubemapLightingResolutionsANDROID>(
      instance_, "xrEnumerateCubemapLightingResolutionsANDROID");
  const auto formats = function<PFN_xrEnumerateCubemapLightingColorFormatsANDROID>(
      instance_, "xrEnumerateCubemapLightingColorFormatsANDROID");
  std::uint32_t count = 0;
  EXPECT_EQ(resolutions(instance_, system_, 0, &count, nullptr), XR_SUCCESS);
  ASSERT_EQ(count, 4U);
  std::array<std::uint32_t, 4> edges{};
  EXPECT_EQ(resolutions(instance_, system_, 4, &count, edges.data()), XR_SUCCESS);
  EXPECT_THAT(edges, ElementsAre(32, 16, 64, 8));
  EXPECT_EQ(resolutions(instance_, system_, 3, &count, edges.data()), XR_ERROR_SIZE_INSUFFICIENT);
  EXPECT_EQ(count, 4U);
  EXPECT_EQ(resolutions(instance_, system_, 0, nullptr, nullptr), XR_ERROR_VALIDATION_FAILURE);
  EXPECT_EQ(resolutions(instance_, system_, 4, &count, nullptr), XR_ERROR_VALIDATION_FAILURE);
  EXPECT_EQ(resolutions(instance_, system_ + 1, 0, &count, nullptr), XR_ERROR_SYSTEM_INVALID);
  EXPECT_EQ(resolutions(XR_NULL_HANDLE, system_, 0, &count, nullptr), XR_ERROR_HANDLE_INVALID);
  std::array<XrCubemapLightingColorFormatANDROID, 3> all{};
  EXPECT_EQ(formats(instance_, system_, 3, &count, all.data()), XR_SUCCESS);
  EXPECT_THAT(all, ElementsAre(XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R16G16B16A16_SFLOAT_ANDROID,
                               XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R32G32B32A32_SFLOAT_ANDROID,
                               XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R32G32B32_SFLOAT_ANDROID));
}

TEST_F(LayerCalls, OnlyCubeMapsThatAreOfferedAreMade) {
  start();
  auto cube = structure<XrCubemapLightEstimatorCreateInfoANDROID>(XR_TYPE_CUBEMAP_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID);
  auto info = structure<XrLightEstimatorCreateInfoANDROID>(XR_TYPE_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID, &cube);
  XrLightEstimatorANDROID created = XR_NULL_HANDLE;
  const struct {
    std::uint32_t edge;
    int format;
    XrResult result;
  } cases[] = {{32, 3, XR_SUCCESS},
               {33, 3, XR_ERROR_FEATURE_UNSUPPORTED},
               {0, 3, XR_ERROR_FEATURE_UNSUPPORTED},
               {0x80000000, 3, XR_ERROR_FEATURE_UNSUPPORTED},
               {32, 4, XR_ERROR_FEATURE_UNSUPPORTED},
               {32, 0, XR_ERROR_FEATURE_UNSUPPORTED}};
  for (const auto& c : cases) {
    cube.cubemapResolution = c.edge;
    cube.colorFormat = static_cast<XrCubemapLightingColorFormatANDROID>(c.format);
    EXPECT_EQ(create_(session_, &info, &created), c.result) << c.edge << ' ' << c.format;
  }
}

TEST_F(LayerCalls, CubeMapsNeedTheirExtensionAnEstimatorForThemAndBuffers) {
  start();
  auto cube = structure<XrCubemapLightEstimatorCreateInfoANDROID>(XR_TYPE_CUBEMAP_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID);
  cube.cubemapResolution = 8;
  cube.colorFormat = XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R16G16B16A16_SFLOAT_ANDROID;
  const XrLightEstimatorANDROID plain = new_estimator(session_), with_cube = new_estimator(session_, &cube);
  auto data = structure<XrCubemapLightingDataANDROID>(XR_TYPE_CUBEMAP_LIGHTING_DATA_ANDROID);
  EXPECT_EQ(result_of(plain, &data), XR_SUCCESS);
  EXPECT_EQ(data.state, XR_LIGHT_ESTIMATE_STATE_INVALID_ANDROID);
  data.imageBufferSize = 8 * 8 * 8;
  EXPECT_EQ(result_of(with_cube, &data), XR_ERROR_VALIDATION_FAILURE) << "the buffers are NULL";
}

TEST_F(LayerCalls, StructuresOfAnExtensionThatIsNotEnabledAreIgnored) {
  start({kLight});
  auto cube = structure<XrCubemapLightEstimatorCreateInfoANDROID>(XR_TYPE_CUBEMAP_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID);
  cube.cubemapResolution = 33;
  const XrLightEstimatorANDROID estimator = new_estimator(session_, &cube);
  auto data = structure<XrCubemapLightingDataANDROID>(XR_TYPE_CUBEMAP_LIGHTING_DATA_ANDROID);
  EXPECT_EQ(result_of(estimator, &data), XR_SUCCESS);
  EXPECT_EQ(data.state, XR_LIGHT_ESTIMATE_STATE_VALID_ANDROID) << "0, as it was";
}

}  // namespace
