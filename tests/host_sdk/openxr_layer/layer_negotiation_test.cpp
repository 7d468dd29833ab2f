// The layer without the loader: what it accepts from one, and two instances at once.
#include <cstddef>
#include <cstdint>
#include <dlfcn.h>
#include <string>

#include <gtest/gtest.h>

#include "host_sdk/openxr_layer/android_light_estimation.h"
#include "host_sdk/openxr_layer/loader_negotiation.h"
#include "host_sdk/openxr_layer/xr_structure.hpp"

namespace {

using lightwell::test::structure;

constexpr const char* kLayer = "XR_APILAYER_LIGHTWELL_light_estimation";
constexpr const char* kLight = XR_ANDROID_LIGHT_ESTIMATION_EXTENSION_NAME;

/// The layer without the loader.
class Negotiation : public ::testing::Test {
 protected:
  void SetUp() override {
    library_ = ::dlopen(OPENXR_LAYER, RTLD_NOW);
    ASSERT_NE(library_, nullptr) << ::dlerror();
    negotiate_ = reinterpret_cast<PFN_xrNegotiateLoaderApiLayerInterface>(
        ::dlsym(library_, "xrNegotiateLoaderApiLayerInterface"));
    ASSERT_NE(negotiate_, nullptr);
  }
  void TearDown() override {
    if (library_ != nullptr) ::dlclose(library_);
  }

  static XrNegotiateLoaderInfo loader() {
    return {XR_LOADER_INTERFACE_STRUCT_LOADER_INFO,
            XR_LOADER_INFO_STRUCT_VERSION,
            sizeof(XrNegotiateLoaderInfo),
            1,
            1,
            XR_MAKE_VERSION(1, 0, 0),
            XR_MAKE_VERSION(1, 0x3ff, 0xfff)};
  }
  static XrNegotiateApiLayerRequest request() {
    XrNegotiateApiLayerRequest out{};
    out.structType = XR_LOADER_INTERFACE_STRUCT_API_LAYER_REQUEST;
    out.structVersion = XR_API_LAYER_INFO_STRUCT_VERSION;
    out.structSize = sizeof(XrNegotiateApiLayerRequest);
    return out;
  }
  /// The result for what `change(loader, request)` has changed.
  template <class Change>
  XrResult changed(const Change& change) const {
    XrNegotiateLoaderInfo l = loader();
    XrNegotiateApiLayerRequest r = request();
    change(l, r);
    const XrResult result = negotiate_(&l, kLayer, &r);
    EXPECT_EQ(result == XR_SUCCESS, r.getInstanceProcAddr != nullptr);
    return result;
  }

  void* library_ = nullptr;
  PFN_xrNegotiateLoaderApiLayerInterface negotiate_ = nullptr;
};

TEST_F(Negotiation, SelectsVersionOneOfTheInterface) {
  XrNegotiateLoaderInfo l = loader();
  XrNegotiateApiLayerRequest r = request();
  l.maxInterfaceVersion = 7;
  ASSERT_EQ(negotiate_(&l, kLayer, &r), XR_SUCCESS);
  EXPECT_EQ(r.layerInterfaceVersion, 1U);
  EXPECT_EQ(XR_VERSION_MAJOR(r.layerApiVersion), 1U);
  EXPECT_NE(r.createApiLayerInstance, nullptr);
}

TEST_F(Negotiation, RefusesWhatItDoesNotKnow) {
  using Loader = XrNegotiateLoaderInfo&;
  using Request = XrNegotiateApiLayerRequest&;
  EXPECT_EQ(changed([](Loader, Request) {}), XR_SUCCESS);
  EXPECT_NE(changed([](Loader l, Request) { l.maxInterfaceVersion = 0, l.minInterfaceVersion = 0; }), XR_SUCCESS);
  EXPECT_NE(changed([](Loader l, Request) { l.minInterfaceVersion = 2, l.maxInterfaceVersion = 3; }), XR_SUCCESS);
  EXPECT_NE(changed([](Loader l, Request) { l.minApiVersion = XR_MAKE_VERSION(2, 0, 0); }), XR_SUCCESS);
  EXPECT_NE(changed([](Loader l, Request) { l.maxApiVersion = XR_MAKE_VERSION(0, 90, 0); }), XR_SUCCESS);
  EXPECT_NE(changed([](Loader l, Request) { l.structSize -= 8; }), XR_SUCCESS);
  EXPECT_NE(changed([](Loader l, Request) { l.structVersion = 2; }), XR_SUCCESS);
  EXPECT_NE(changed([](Loader, Request r) { r.structType = XR_LOADER_INTERFACE_STRUCT_LOADER_INFO; }), XR_SUCCESS);
  EXPECT_NE(changed([](Loader, Request r) { r.structSize += 8; }), XR_SUCCESS);
  XrNegotiateLoaderInfo l = loader();
  XrNegotiateApiLayerRequest r = request();
  EXPECT_NE(negotiate_(&l, "XR_APILAYER_OTHER", &r), XR_SUCCESS);
  EXPECT_NE(negotiate_(&l, nullptr, &r), XR_SUCCESS);
  EXPECT_NE(negotiate_(nullptr, kLayer, &r), XR_SUCCESS);
  EXPECT_NE(negotiate_(&l, kLayer, nullptr), XR_SUCCESS);
}

/// What a runtime answers the loader; the library is that of the simulated one.
struct RuntimeRequest {
  std::uint32_t type = 3, version = 1;
  std::size_t size = sizeof(RuntimeRequest);
  std::uint32_t interface_version = 0;
  XrVersion api = 0;
  PFN_xrGetInstanceProcAddr get_proc = nullptr;
};

PFN_xrGetInstanceProcAddr runtime_get_proc = nullptr;

XRAPI_ATTR XrResult XRAPI_CALL create_in_runtime(const XrInstanceCreateInfo* info, const XrApiLayerCreateInfo*,
                                                 XrInstance* out) {
  PFN_xrVoidFunction create = nullptr;
  runtime_get_proc(XR_NULL_HANDLE, "xrCreateInstance", &create);
  return reinterpret_cast<PFN_xrCreateInstance>(create)(info, out);
}

/// Two instances at once, which Debian's loader does not allow.
class TwoInstances : public Negotiation {
 protected:
  void SetUp() override {
    Negotiation::SetUp();
    runtime_ = ::dlopen(SIMULATED_XR_RUNTIME, RTLD_NOW);
    ASSERT_NE(runtime_, nullptr) << ::dlerror();
    const auto negotiate = reinterpret_cast<XrResult (*)(const XrNegotiateLoaderInfo*, RuntimeRequest*)>(
        ::dlsym(runtime_, "xrNegotiateLoaderRuntimeInterface"));
    const XrNegotiateLoaderInfo l = loader();
    RuntimeRequest runtime;
    ASSERT_EQ(negotiate(&l, &runtime), XR_SUCCESS);
    runtime_get_proc = runtime.get_proc;
    XrNegotiateApiLayerRequest layer = request();
    ASSERT_EQ(negotiate_(&l, kLayer, &layer), XR_SUCCESS);
    get_proc_ = layer.getInstanceProcAddr;
    create_ = layer.createApiLayerInstance;
    next_.structType = XR_LOADER_INTERFACE_STRUCT_API_LAYER_NEXT_INFO;
    next_.structVersion = XR_API_LAYER_NEXT_INFO_STRUCT_VERSION;
    next_.structSize = sizeof next_;
    std::string(kLayer).copy(next_.layerName, sizeof next_.layerName - 1);
    next_.nextGetInstanceProcAddr = runtime.get_proc;
    next_.nextCreateApiLayerInstance = create_in_runtime;
    info_.structType = XR_LOADER_INTERFACE_STRUCT_API_LAYER_CREATE_INFO;
    info_.structVersion = XR_API_LAYER_CREATE_INFO_STRUCT_VERSION;
    info_.structSize = sizeof info_;
    info_.nextInfo = &next_;
  }
  void TearDown() override {
    Negotiation::TearDown();
    if (runtime_ != nullptr) ::dlclose(runtime_);
  }

  XrResult create(XrInstance& out) {
    const char* const names[] = {kLight};
    auto info = structure<XrInstanceCreateInfo>(XR_TYPE_INSTANCE_CREATE_INFO);
    info.enabledExtensionCount = 1;
    info.enabledExtensionNames = names;
    return create_(&info, &info_, &out);
  }
  template <class Function>
  Function layer_function(XrInstance instance, const char* name) const {
    PFN_xrVoidFunction out = nullptr;
    get_proc_(instance, name, &out);
    return reinterpret_cast<Function>(out);
  }
  [[nodiscard]] XrLightEstimatorANDROID estimator_of(XrInstance instance) const {
    auto session_info = structure<XrSessionCreateInfo>(XR_TYPE_SESSION_CREATE_INFO);
    XrSession session = XR_NULL_HANDLE;
    EXPECT_EQ(layer_function<PFN_xrCreateSession>(instance, "xrCreateSession")(instance, &session_info, &session),
              XR_SUCCESS);
    auto info = structure<XrLightEstimatorCreateInfoANDROID>(XR_TYPE_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID);
    XrLightEstimatorANDROID out = XR_NULL_HANDLE;
    EXPECT_EQ(layer_function<PFN_xrCreateLightEstimatorANDROID>(instance, "xrCreateLightEstimatorANDROID")(session,
                                                                                                           &info, &out),
              XR_SUCCESS);
    return out;
  }

  void* runtime_ = nullptr;
  PFN_xrGetInstanceProcAddr get_proc_ = nullptr;
  PFN_xrCreateApiLayerInstance create_ = nullptr;
  XrApiLayerNextInfo next_{};
  XrApiLayerCreateInfo info_{};
};

TEST_F(TwoInstances, EachDestroysItsOwnEstimators) {
  XrInstance one = XR_NULL_HANDLE, other = XR_NULL_HANDLE;
  ASSERT_EQ(create(one), XR_SUCCESS);
  ASSERT_EQ(create(other), XR_SUCCESS);
  const XrLightEstimatorANDROID of_one = estimator_of(one), of_other = estimator_of(other);
  EXPECT_NE(of_one, of_other);
  const auto get = layer_function<PFN_xrGetLightEstimateANDROID>(one, "xrGetLightEstimateANDROID");
  const auto destroy = layer_function<PFN_xrDestroyInstance>(one, "xrDestroyInstance");
  auto output = structure<XrLightEstimateANDROID>(XR_TYPE_LIGHT_ESTIMATE_ANDROID);
  // The runtime reports that its session still lives.
  EXPECT_EQ(destroy(one), XR_ERROR_CALL_ORDER_INVALID);
  EXPECT_EQ(get(of_one, nullptr, &output), XR_ERROR_HANDLE_INVALID);
  EXPECT_EQ(get(of_other, nullptr, &output), XR_ERROR_VALIDATION_FAILURE) << "its handle is valid, its input is NULL";
  EXPECT_EQ(destroy(other), XR_ERROR_CALL_ORDER_INVALID);
  EXPECT_EQ(destroy(other), XR_ERROR_HANDLE_INVALID);
}

TEST_F(TwoInstances, AChainThatTheLayerDoesNotKnowIsRefused) {
  XrInstance instance = XR_NULL_HANDLE;
  next_.structVersion = 2;
  EXPECT_EQ(create(instance), XR_ERROR_INITIALIZATION_FAILED);
  next_.structVersion = 1;
  info_.structSize = 8;
  EXPECT_EQ(create(instance), XR_ERROR_INITIALIZATION_FAILED);
  info_.structSize = sizeof info_;
  info_.nextInfo = nullptr;
  EXPECT_EQ(create(instance), XR_ERROR_INITIALIZATION_FAILED);
  info_.nextInfo = &next_;
  next_.layerName[0] = 'Y';
  EXPECT_EQ(create(instance), XR_ERROR_INITIALIZATION_FAILED);
}

}  // namespace
