// XrTime and the host's CLOCK_MONOTONIC.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include "runtime.hpp"

namespace lightwell::xr {

/// Converts by XR_KHR_convert_timespec_time where the runtime has it. Where it has not, the application's first time
/// counts as the moment of that call, and so does a later time that would be more than a second away from its call. Any
/// thread.
class RuntimeClock {
 public:
  explicit RuntimeClock(const Runtime& runtime) : runtime_(runtime) {}

  /// ns of CLOCK_MONOTONIC. XR_ERROR_TIME_INVALID for times that the runtime refuses, and for 0 or less.
  [[nodiscard]] XrResult to_host(XrTime time, std::int64_t& host_ns);

  /// Not before the first to_host().
  [[nodiscard]] XrResult to_xr(std::int64_t host_ns, XrTime& out);

 private:
  const Runtime& runtime_;
  std::mutex mutex_;
  std::optional<std::int64_t> offset_ns_;  ///< XrTime minus CLOCK_MONOTONIC, without the extension.
};

}  // namespace lightwell::xr
