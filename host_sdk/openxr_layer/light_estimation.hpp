// The functions of XR_ANDROID_light_estimation and XR_ANDROID_light_estimation_cubemap.
#pragma once

#include <string_view>

#include "instance.hpp"

namespace lightwell::xr {

/// The function of an enabled extension, null for another name.
[[nodiscard]] PFN_xrVoidFunction light_estimation_function(const Instance& instance, std::string_view name);

/// Sets the layer's structures in the chain of an XrSystemProperties.
[[nodiscard]] XrResult fill_system_properties(const Instance& instance, XrSystemProperties& properties);

}  // namespace lightwell::xr
