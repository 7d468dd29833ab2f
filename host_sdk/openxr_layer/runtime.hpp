// What the layer calls below itself: the next layer, or the runtime.
#pragma once

#include <time.h>
// Before openxr_platform.h: selects the conversion of times.
#define XR_USE_TIMESPEC 1
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

namespace lightwell::xr {

/// Functions of one instance, below the layer; a null pointer where there is none.
struct Runtime {
  XrInstance instance = XR_NULL_HANDLE;
  PFN_xrGetInstanceProcAddr get_proc = nullptr;
  PFN_xrDestroyInstance destroy_instance = nullptr;
  PFN_xrGetSystemProperties get_system_properties = nullptr;
  PFN_xrCreateSession create_session = nullptr;
  PFN_xrDestroySession destroy_session = nullptr;
  PFN_xrCreateReferenceSpace create_reference_space = nullptr;
  PFN_xrDestroySpace destroy_space = nullptr;
  PFN_xrLocateSpace locate_space = nullptr;
  PFN_xrConvertTimespecTimeToTimeKHR to_xr_time = nullptr;
  PFN_xrConvertTimeToTimespecTimeKHR to_timespec = nullptr;
  PFN_xrCreateDebugUtilsMessengerEXT create_messenger = nullptr;
  PFN_xrSubmitDebugUtilsMessageEXT submit_message = nullptr;
};

template <class Function>
void load(const Runtime& runtime, const char* name, Function& out) {
  PFN_xrVoidFunction found = nullptr;
  if (XR_FAILED(runtime.get_proc(runtime.instance, name, &found))) found = nullptr;
  out = reinterpret_cast<Function>(found);
}

}  // namespace lightwell::xr
