// The layer's place in the chain of calls: negotiation with the loader, instances and sessions. All functions that are
// not here or in light_estimation.cpp are those of the next layer.
#include <algorithm>
#include <cstring>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "android_light_estimation.h"
#include "guarded.hpp"
#include "light_estimation.hpp"
#include "loader_negotiation.h"
#include "registry.hpp"

namespace lightwell::xr {
namespace {

bool is(const char* name, std::string_view other) { return name != nullptr && name == other; }

/// The application's extensions, without those of the layer, and what it enables for itself.
struct Extensions {
  std::vector<const char*> below;
  Extension light_estimation = Extension::disabled, cubemap = Extension::disabled;
  Extension time = Extension::disabled;
};

Extensions read_extensions(const XrInstanceCreateInfo& info) {
  Extensions out;
  for (std::uint32_t i = 0; i < info.enabledExtensionCount; ++i) {
    const char* const name = info.enabledExtensionNames[i];
    if (is(name, XR_ANDROID_LIGHT_ESTIMATION_EXTENSION_NAME)) {
      out.light_estimation = Extension::enabled;
      continue;
    }
    if (is(name, XR_ANDROID_LIGHT_ESTIMATION_CUBEMAP_EXTENSION_NAME)) {
      out.cubemap = Extension::enabled;
      continue;
    }
    if (is(name, XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME)) out.time = Extension::enabled;
    out.below.push_back(name);
  }
  return out;
}

Runtime load_runtime(XrInstance instance, PFN_xrGetInstanceProcAddr get_proc, const Extensions& extensions) {
  Runtime out;
  out.instance = instance;
  out.get_proc = get_proc;
  load(out, "xrDestroyInstance", out.destroy_instance);
  if (extensions.light_estimation == Extension::disabled) return out;
  load(out, "xrGetSystemProperties", out.get_system_properties);
  load(out, "xrCreateSession", out.create_session);
  load(out, "xrDestroySession", out.destroy_session);
  load(out, "xrCreateReferenceSpace", out.create_reference_space);
  load(out, "xrDestroySpace", out.destroy_space);
  load(out, "xrLocateSpace", out.locate_space);
  if (extensions.time == Extension::enabled) {
    load(out, "xrConvertTimespecTimeToTimeKHR", out.to_xr_time);
    load(out, "xrConvertTimeToTimespecTimeKHR", out.to_timespec);
    // One without the other is of no use.
    if (out.to_xr_time == nullptr) out.to_timespec = nullptr;
    if (out.to_timespec == nullptr) out.to_xr_time = nullptr;
  }
  load(out, "xrCreateDebugUtilsMessengerEXT", out.create_messenger);
  load(out, "xrSubmitDebugUtilsMessageEXT", out.submit_message);
  return out;
}

/// Whether all that the layer needs is there.
bool is_complete(const Runtime& r, Extension light_estimation) {
  if (r.destroy_instance == nullptr) return false;
  return light_estimation == Extension::disabled ||
         (r.get_system_properties != nullptr && r.create_session != nullptr && r.destroy_session != nullptr &&
          r.create_reference_space != nullptr && r.destroy_space != nullptr && r.locate_space != nullptr);
}

/// Creates the instance below with the application's extensions, without those of the layer, and with the conversion of
/// times where it is there. It is tried, because not every layer below answers before there is an instance which
/// extensions there are.
XrResult create_below(const XrInstanceCreateInfo& info, const XrApiLayerCreateInfo& layer, Extensions& extensions,
                      XrInstance* out) {
  const XrApiLayerNextInfo& next = *layer.nextInfo;
  XrApiLayerCreateInfo layer_below = layer;
  layer_below.nextInfo = next.next;
  if (extensions.light_estimation == Extension::disabled)
    return next.nextCreateApiLayerInstance(&info, &layer_below, out);
  std::vector<const char*> names = extensions.below;
  XrInstanceCreateInfo info_below = info;
  const auto attempt = [&] {
    info_below.enabledExtensionCount = static_cast<std::uint32_t>(names.size());
    info_below.enabledExtensionNames = names.data();
    return next.nextCreateApiLayerInstance(&info_below, &layer_below, out);
  };
  if (extensions.time == Extension::enabled) return attempt();
  names.push_back(XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME);
  const XrResult result = attempt();
  if (XR_SUCCEEDED(result)) extensions.time = Extension::enabled;
  if (result != XR_ERROR_EXTENSION_NOT_PRESENT) return result;
  names.pop_back();
  return attempt();
}

XrResult create_instance(const XrInstanceCreateInfo* info, const XrApiLayerCreateInfo* layer, XrInstance* out) {
  if (layer == nullptr || layer->structType != XR_LOADER_INTERFACE_STRUCT_API_LAYER_CREATE_INFO ||
      layer->structVersion != XR_API_LAYER_CREATE_INFO_STRUCT_VERSION || layer->structSize != sizeof *layer ||
      layer->nextInfo == nullptr)
    return XR_ERROR_INITIALIZATION_FAILED;
  const XrApiLayerNextInfo& next = *layer->nextInfo;
  if (next.structType != XR_LOADER_INTERFACE_STRUCT_API_LAYER_NEXT_INFO ||
      next.structVersion != XR_API_LAYER_NEXT_INFO_STRUCT_VERSION || next.structSize != sizeof next ||
      std::strncmp(next.layerName, kLayerName, sizeof next.layerName) != 0 || next.nextGetInstanceProcAddr == nullptr ||
      next.nextCreateApiLayerInstance == nullptr)
    return XR_ERROR_INITIALIZATION_FAILED;
  if (info == nullptr || out == nullptr || (info->enabledExtensionCount > 0 && info->enabledExtensionNames == nullptr))
    return XR_ERROR_VALIDATION_FAILURE;

  Extensions extensions = read_extensions(*info);
  // It depends on XR_ANDROID_light_estimation.
  if (extensions.cubemap == Extension::enabled && extensions.light_estimation == Extension::disabled)
    return XR_ERROR_VALIDATION_FAILURE;
  Configuration configuration;
  if (extensions.light_estimation == Extension::enabled) configuration = read_configuration();

  if (const XrResult r = create_below(*info, *layer, extensions, out); XR_FAILED(r)) return r;
  const Runtime runtime = load_runtime(*out, next.nextGetInstanceProcAddr, extensions);
  if (!is_complete(runtime, extensions.light_estimation)) {
    if (runtime.destroy_instance != nullptr) runtime.destroy_instance(*out);
    return XR_ERROR_INITIALIZATION_FAILED;
  }
  const auto instance = std::make_shared<Instance>(runtime, std::move(configuration));
  instance->light_estimation = extensions.light_estimation;
  instance->cubemap = extensions.cubemap;
  Registry::get().add(instance);
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL create_api_layer_instance(const XrInstanceCreateInfo* info,
                                                         const XrApiLayerCreateInfo* layer, XrInstance* out) {
  return guarded([&] { return create_instance(info, layer, out); });
}

XRAPI_ATTR XrResult XRAPI_CALL destroy_instance(XrInstance handle) {
  return guarded([&] {
    std::shared_ptr<Instance> instance = Registry::get().remove(handle);
    if (!instance) return XR_ERROR_HANDLE_INVALID;
    const PFN_xrDestroyInstance below = instance->runtime.destroy_instance;
    // Ends its thread, which may send messages to the instance.
    instance.reset();
    return below(handle);
  });
}

XRAPI_ATTR XrResult XRAPI_CALL get_system_properties(XrInstance handle, XrSystemId system,
                                                     XrSystemProperties* properties) {
  const std::shared_ptr<Instance> instance = Registry::get().instance(handle);
  if (!instance) return XR_ERROR_HANDLE_INVALID;
  if (properties == nullptr) return instance->runtime.get_system_properties(handle, system, properties);
  SystemPropertiesChain chain(*instance, *properties);
  if (chain.is_loop()) return XR_ERROR_VALIDATION_FAILURE;
  const XrResult result = instance->runtime.get_system_properties(handle, system, properties);
  if (XR_SUCCEEDED(result)) chain.fill();
  return result;
}

XRAPI_ATTR XrResult XRAPI_CALL create_session(XrInstance handle, const XrSessionCreateInfo* info, XrSession* out) {
  return guarded([&] {
    const std::shared_ptr<Instance> instance = Registry::get().instance(handle);
    if (!instance) return XR_ERROR_HANDLE_INVALID;
    const XrResult result = instance->runtime.create_session(handle, info, out);
    if (XR_SUCCEEDED(result)) Registry::get().add(*out, handle);
    return result;
  });
}

XRAPI_ATTR XrResult XRAPI_CALL destroy_session(XrSession session) {
  return guarded([&] {
    const std::shared_ptr<Instance> instance = Registry::get().instance_of(session);
    if (!instance) return XR_ERROR_HANDLE_INVALID;
    Registry::get().remove(session);
    return instance->runtime.destroy_session(session);
  });
}

XRAPI_ATTR XrResult XRAPI_CALL create_messenger(XrInstance handle, const XrDebugUtilsMessengerCreateInfoEXT* info,
                                                XrDebugUtilsMessengerEXT* out) {
  const std::shared_ptr<Instance> instance = Registry::get().instance(handle);
  if (!instance) return XR_ERROR_HANDLE_INVALID;
  const XrResult result = instance->runtime.create_messenger(handle, info, out);
  if (XR_SUCCEEDED(result)) instance->messages.use_messengers();
  return result;
}

template <class Function>
PFN_xrVoidFunction untyped_function(Function function) {
  return reinterpret_cast<PFN_xrVoidFunction>(function);
}

XRAPI_ATTR XrResult XRAPI_CALL get_instance_proc_addr(XrInstance handle, const char* name, PFN_xrVoidFunction* out) {
  if (name == nullptr || out == nullptr) return XR_ERROR_VALIDATION_FAILURE;
  *out = nullptr;
  const std::shared_ptr<Instance> instance = Registry::get().instance(handle);
  if (!instance) return XR_ERROR_HANDLE_INVALID;
  if (is(name, "xrGetInstanceProcAddr"))
    *out = untyped_function(PFN_xrGetInstanceProcAddr{get_instance_proc_addr});
  else if (is(name, "xrDestroyInstance"))
    *out = untyped_function(PFN_xrDestroyInstance{destroy_instance});
  else if (instance->serves() && is(name, "xrGetSystemProperties"))
    *out = untyped_function(PFN_xrGetSystemProperties{get_system_properties});
  else if (instance->serves() && is(name, "xrCreateSession"))
    *out = untyped_function(PFN_xrCreateSession{create_session});
  else if (instance->serves() && is(name, "xrDestroySession"))
    *out = untyped_function(PFN_xrDestroySession{destroy_session});
  else if (instance->runtime.create_messenger != nullptr && is(name, "xrCreateDebugUtilsMessengerEXT"))
    *out = untyped_function(PFN_xrCreateDebugUtilsMessengerEXT{create_messenger});
  else
    *out = light_estimation_function(*instance, name);
  return *out != nullptr ? XR_SUCCESS : instance->runtime.get_proc(handle, name, out);
}

}  // namespace
}  // namespace lightwell::xr

/// The only exported function: OpenXR loader specification, "Loader/API Layer Interface Negotiation".
extern "C" __attribute__((visibility("default"))) XRAPI_ATTR XrResult XRAPI_CALL xrNegotiateLoaderApiLayerInterface(
    const XrNegotiateLoaderInfo* loader, const char* layer_name, XrNegotiateApiLayerRequest* request) {
  using namespace lightwell::xr;
  const bool known = loader != nullptr && loader->structType == XR_LOADER_INTERFACE_STRUCT_LOADER_INFO &&
                     loader->structVersion == XR_LOADER_INFO_STRUCT_VERSION && loader->structSize == sizeof *loader &&
                     request != nullptr && request->structType == XR_LOADER_INTERFACE_STRUCT_API_LAYER_REQUEST &&
                     request->structVersion == XR_API_LAYER_INFO_STRUCT_VERSION &&
                     request->structSize == sizeof *request && is(layer_name, kLayerName);
  if (!known || loader->minInterfaceVersion > XR_CURRENT_LOADER_API_LAYER_VERSION ||
      loader->maxInterfaceVersion < XR_CURRENT_LOADER_API_LAYER_VERSION ||
      loader->minApiVersion > XR_CURRENT_API_VERSION || loader->maxApiVersion < XR_MAKE_VERSION(1, 0, 0))
    return XR_ERROR_INITIALIZATION_FAILED;
  request->layerInterfaceVersion = XR_CURRENT_LOADER_API_LAYER_VERSION;
  request->layerApiVersion = XR_CURRENT_API_VERSION;
  request->getInstanceProcAddr = get_instance_proc_addr;
  request->createApiLayerInstance = create_api_layer_instance;
  return XR_SUCCESS;
}
