#include "runtime_clock.hpp"

#include <cstdlib>

#include <lightwell/lightwell.h>

namespace lightwell::xr {

constexpr std::int64_t kSecondNs = 1'000'000'000;

XrResult RuntimeClock::to_host(XrTime time, std::int64_t& host_ns) {
  if (time <= 0) return XR_ERROR_TIME_INVALID;
  if (runtime_.to_timespec == nullptr) {
    const std::int64_t now_ns = lw_now_ns();
    const std::lock_guard lock(mutex_);
    if (!offset_ns_ || std::abs(time - *offset_ns_ - now_ns) > kSecondNs) offset_ns_ = time - now_ns;
    host_ns = time - *offset_ns_;
    return XR_SUCCESS;
  }
  timespec moment{};
  const XrResult result = runtime_.to_timespec(runtime_.instance, time, &moment);
  if (XR_FAILED(result)) return result;
  host_ns = static_cast<std::int64_t>(moment.tv_sec) * kSecondNs + moment.tv_nsec;
  return XR_SUCCESS;
}

XrResult RuntimeClock::to_xr(std::int64_t host_ns, XrTime& out) {
  if (runtime_.to_xr_time == nullptr) {
    const std::lock_guard lock(mutex_);
    out = host_ns + offset_ns_.value_or(0);
    return XR_SUCCESS;
  }
  timespec moment{};
  moment.tv_sec = static_cast<time_t>(host_ns / kSecondNs);
  moment.tv_nsec = static_cast<long>(host_ns % kSecondNs);
  return runtime_.to_xr_time(runtime_.instance, &moment, &out);
}

}  // namespace lightwell::xr
