#include "light_estimation.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "android_light_estimation.h"
#include "chain.hpp"
#include "estimator.hpp"
#include "guarded.hpp"
#include "registry.hpp"

namespace lightwell::xr {
namespace {

constexpr const char* kCreate = "xrCreateLightEstimatorANDROID";
constexpr const char* kGet = "xrGetLightEstimateANDROID";

XrResult invalid(Instance& instance, const char* function, const std::string& text) {
  instance.messages.error(function, text);
  return XR_ERROR_VALIDATION_FAILURE;
}

/// Stores the structure in `slot`, which holds the only one of its type in a chain.
template <class Structure>
XrResult take(Instance& instance, const char* function, XrBaseOutStructure& from, Structure*& slot) {
  if (slot != nullptr)
    return invalid(instance, function,
                   "two structures of type " + std::to_string(static_cast<int>(from.type)) +
                       " are chained; TOTAL and AMBIENT harmonics need a call each");
  slot = reinterpret_cast<Structure*>(&from);
  return XR_SUCCESS;
}

bool offered(const XrCubemapLightEstimatorCreateInfoANDROID& cube) {
  return std::ranges::find(CubeRenderer::kResolutions, cube.cubemapResolution) != CubeRenderer::kResolutions.end() &&
         std::ranges::find(CubeRenderer::kFormats, cube.colorFormat) != CubeRenderer::kFormats.end();
}

XrResult create(XrSession session, const XrLightEstimatorCreateInfoANDROID* info, XrLightEstimatorANDROID* out) {
  const std::shared_ptr<Instance> instance = Registry::get().instance_of(session);
  if (!instance) return XR_ERROR_HANDLE_INVALID;
  if (info == nullptr || info->type != XR_TYPE_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID || out == nullptr)
    return invalid(*instance, kCreate,
                   "createInfo or outHandle is NULL, or its type is not XR_TYPE_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID");
  XrCubemapLightEstimatorCreateInfoANDROID* cube = nullptr;
  const XrResult chain = for_each_chained(info->next, [&](XrBaseOutStructure& s) {
    if (s.type != XR_TYPE_CUBEMAP_LIGHT_ESTIMATOR_CREATE_INFO_ANDROID || !instance->serves_cubemap()) return XR_SUCCESS;
    return take(*instance, kCreate, s, cube);
  });
  if (XR_FAILED(chain)) return chain;
  if (!instance->supported()) {
    instance->messages.error(kCreate, instance->configuration.error);
    return XR_ERROR_FEATURE_UNSUPPORTED;
  }
  if (cube != nullptr && !offered(*cube)) {
    instance->messages.error(kCreate, "cubemapResolution or colorFormat is none of those that are enumerated");
    return XR_ERROR_FEATURE_UNSUPPORTED;
  }
  std::shared_ptr<Estimator> estimator;
  const XrResult result = Estimator::make(*instance, session, cube, estimator);
  if (XR_SUCCEEDED(result)) *out = Registry::get().add(std::move(estimator));
  return result;
}

/// Sorts the structures of `output` into `parts`.
XrResult read_parts(Instance& instance, XrLightEstimateANDROID& output, EstimateParts& parts) {
  parts.estimate = &output;
  return for_each_chained(output.next, [&](XrBaseOutStructure& s) {
    switch (static_cast<int>(s.type)) {
      case XR_TYPE_DIRECTIONAL_LIGHT_ANDROID:
        return take(instance, kGet, s, parts.directional);
      case XR_TYPE_AMBIENT_LIGHT_ANDROID:
        return take(instance, kGet, s, parts.ambient);
      case XR_TYPE_SPHERICAL_HARMONICS_ANDROID:
        return take(instance, kGet, s, parts.harmonics);
      case XR_TYPE_CUBEMAP_LIGHTING_DATA_ANDROID:
        return instance.serves_cubemap() ? take(instance, kGet, s, parts.cube) : XR_SUCCESS;
      default:
        return XR_SUCCESS;
    }
  });
}

bool has_buffers(const XrCubemapLightingDataANDROID& cube) {
  const std::uint8_t* const buffers[] = {cube.imageBufferRight,  cube.imageBufferLeft,  cube.imageBufferTop,
                                         cube.imageBufferBottom, cube.imageBufferFront, cube.imageBufferBack};
  return cube.imageBufferSize == 0 || std::ranges::count(buffers, nullptr) == 0;
}

XrResult get(Estimator& estimator, Instance& instance, const XrLightEstimateGetInfoANDROID* input,
             XrLightEstimateANDROID* output) {
  if (input == nullptr || input->type != XR_TYPE_LIGHT_ESTIMATE_GET_INFO_ANDROID)
    return invalid(instance, kGet, "input is NULL, or its type is not XR_TYPE_LIGHT_ESTIMATE_GET_INFO_ANDROID");
  if (output == nullptr || output->type != XR_TYPE_LIGHT_ESTIMATE_ANDROID)
    return invalid(instance, kGet, "output is NULL, or its type is not XR_TYPE_LIGHT_ESTIMATE_ANDROID");
  EstimateParts parts;
  if (const XrResult result = read_parts(instance, *output, parts); XR_FAILED(result)) return result;
  if (parts.harmonics != nullptr && parts.harmonics->kind != XR_SPHERICAL_HARMONICS_KIND_TOTAL_ANDROID &&
      parts.harmonics->kind != XR_SPHERICAL_HARMONICS_KIND_AMBIENT_ANDROID)
    return invalid(instance, kGet, "XrSphericalHarmonicsANDROID::kind is neither TOTAL nor AMBIENT");
  if (parts.cube != nullptr && !has_buffers(*parts.cube))
    return invalid(instance, kGet, "an image buffer of XrCubemapLightingDataANDROID is NULL");
  return estimator.estimate(*input, parts);
}

/// The two-call idiom (OpenXR 1.0, 2.11, "Buffer Size Parameters"), after a check of the system by the runtime.
template <class T>
XrResult enumerate(XrInstance handle, XrSystemId system, std::span<const T> values, std::uint32_t capacity,
                   std::uint32_t* count, T* out) {
  const std::shared_ptr<Instance> instance = Registry::get().instance(handle);
  if (!instance) return XR_ERROR_HANDLE_INVALID;
  if (count == nullptr || (capacity > 0 && out == nullptr))
    return invalid(*instance, "xrEnumerateCubemapLighting...ANDROID", "the count or the array is NULL");
  XrSystemProperties properties{};
  properties.type = XR_TYPE_SYSTEM_PROPERTIES;
  const XrResult known = instance->runtime.get_system_properties(handle, system, &properties);
  if (XR_FAILED(known)) return known;
  *count = instance->supported() ? static_cast<std::uint32_t>(values.size()) : 0;
  if (capacity == 0) return XR_SUCCESS;
  if (capacity < *count) return XR_ERROR_SIZE_INSUFFICIENT;
  std::copy_n(values.begin(), *count, out);
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL create_light_estimator(XrSession session, XrLightEstimatorCreateInfoANDROID* createInfo,
                                                      XrLightEstimatorANDROID* outHandle) {
  return guarded([&] { return create(session, createInfo, outHandle); });
}

XRAPI_ATTR XrResult XRAPI_CALL destroy_light_estimator(XrLightEstimatorANDROID estimator) {
  return guarded([&] { return Registry::get().remove(estimator) ? XR_SUCCESS : XR_ERROR_HANDLE_INVALID; });
}

XRAPI_ATTR XrResult XRAPI_CALL get_light_estimate(XrLightEstimatorANDROID estimator,
                                                  const XrLightEstimateGetInfoANDROID* input,
                                                  XrLightEstimateANDROID* output) {
  return guarded([&] {
    const std::shared_ptr<Estimator> found = Registry::get().estimator(estimator);
    return found ? get(*found, found->instance(), input, output) : XR_ERROR_HANDLE_INVALID;
  });
}

XRAPI_ATTR XrResult XRAPI_CALL enumerate_resolutions(XrInstance instance, XrSystemId system, std::uint32_t capacity,
                                                     std::uint32_t* count, std::uint32_t* resolutions) {
  return guarded([&] {
    return enumerate(instance, system, std::span<const std::uint32_t>(CubeRenderer::kResolutions), capacity, count,
                     resolutions);
  });
}

XRAPI_ATTR XrResult XRAPI_CALL enumerate_formats(XrInstance instance, XrSystemId system, std::uint32_t capacity,
                                                 std::uint32_t* count, XrCubemapLightingColorFormatANDROID* formats) {
  return guarded([&] {
    return enumerate(instance, system, std::span<const XrCubemapLightingColorFormatANDROID>(CubeRenderer::kFormats),
                     capacity, count, formats);
  });
}

template <class Function>
PFN_xrVoidFunction untyped(Function function) {
  return reinterpret_cast<PFN_xrVoidFunction>(function);
}

}  // namespace

PFN_xrVoidFunction light_estimation_function(const Instance& instance, std::string_view name) {
  if (!instance.serves()) return nullptr;
  if (name == kCreate) return untyped(PFN_xrCreateLightEstimatorANDROID{create_light_estimator});
  if (name == "xrDestroyLightEstimatorANDROID")
    return untyped(PFN_xrDestroyLightEstimatorANDROID{destroy_light_estimator});
  if (name == kGet) return untyped(PFN_xrGetLightEstimateANDROID{get_light_estimate});
  if (!instance.serves_cubemap()) return nullptr;
  if (name == "xrEnumerateCubemapLightingResolutionsANDROID")
    return untyped(PFN_xrEnumerateCubemapLightingResolutionsANDROID{enumerate_resolutions});
  if (name == "xrEnumerateCubemapLightingColorFormatsANDROID")
    return untyped(PFN_xrEnumerateCubemapLightingColorFormatsANDROID{enumerate_formats});
  return nullptr;
}

SystemPropertiesChain::SystemPropertiesChain(const Instance& instance, XrSystemProperties& properties)
    : instance_(instance) {
  auto** slot = reinterpret_cast<XrBaseOutStructure**>(&properties.next);
  for (int visited = 0; *slot != nullptr; ++visited) {
    XrBaseOutStructure& s = **slot;
    const bool ours =
        s.type == XR_TYPE_SYSTEM_LIGHT_ESTIMATION_PROPERTIES_ANDROID ||
        (s.type == XR_TYPE_SYSTEM_CUBEMAP_LIGHT_ESTIMATION_PROPERTIES_ANDROID && instance.serves_cubemap());
    is_loop_ = visited == kMaxChained || (ours && count_ == removed_.size());
    if (is_loop_) return;
    if (ours) {
      removed_[count_++] = {slot, &s};
      *slot = s.next;
    } else {
      slot = &s.next;
    }
  }
}

SystemPropertiesChain::~SystemPropertiesChain() {
  while (count_ > 0) {
    --count_;
    *removed_[count_].slot = removed_[count_].structure;
  }
}

void SystemPropertiesChain::fill() const {
  const XrBool32 supported = instance_.supported() ? XR_TRUE : XR_FALSE;
  for (std::size_t i = 0; i < count_; ++i) {
    XrBaseOutStructure* const s = removed_[i].structure;
    if (s->type == XR_TYPE_SYSTEM_LIGHT_ESTIMATION_PROPERTIES_ANDROID)
      reinterpret_cast<XrSystemLightEstimationPropertiesANDROID*>(s)->supportsLightEstimation = supported;
    else
      reinterpret_cast<XrSystemCubemapLightEstimationPropertiesANDROID*>(s)->supportsCubemapLightEstimation = supported;
  }
}

}  // namespace lightwell::xr
