// Structure chains: the `next` pointers of OpenXR's structures.
#pragma once

#include <openxr/openxr.h>

namespace lightwell::xr {

/// More structures than OpenXR defines for one chain; a longer one is a loop.
inline constexpr int kMaxChained = 256;

/// Calls `visit(XrBaseOutStructure&)` for each structure of the chain that begins at `next`, until it returns an error,
/// which this returns. XR_ERROR_VALIDATION_FAILURE for a loop.
template <class Visit>
[[nodiscard]] XrResult for_each_chained(const void* next, const Visit& visit) {
  auto* at = static_cast<XrBaseOutStructure*>(const_cast<void*>(next));
  for (int i = 0; at != nullptr; at = at->next, ++i) {
    if (i == kMaxChained) return XR_ERROR_VALIDATION_FAILURE;
    if (const XrResult result = visit(*at); XR_FAILED(result)) return result;
  }
  return XR_SUCCESS;
}

}  // namespace lightwell::xr
