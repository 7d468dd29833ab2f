// No exception leaves the layer: standard containers and threads may throw.
#pragma once

#include <exception>
#include <new>

#include <openxr/openxr.h>

namespace lightwell::xr {

/// The XrResult of `work()`, or that of the exception that it throws.
template <class Work>
XrResult guarded(const Work& work) noexcept {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return XR_ERROR_OUT_OF_MEMORY;
  } catch (const std::exception&) {
    return XR_ERROR_RUNTIME_FAILURE;
  }
}

}  // namespace lightwell::xr
