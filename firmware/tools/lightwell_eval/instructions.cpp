#include "tools/lightwell_eval/instructions.hpp"

#include <unistd.h>

#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>

namespace lightwell::eval {

std::optional<std::uint64_t> count_instructions(const std::function<void()>& work) {
  perf_event_attr what{};
  what.type = PERF_TYPE_HARDWARE;
  what.size = sizeof what;
  what.config = PERF_COUNT_HW_INSTRUCTIONS;
  what.disabled = 1;
  what.exclude_kernel = 1;
  what.exclude_hv = 1;
  what.read_format = PERF_FORMAT_TOTAL_TIME_ENABLED | PERF_FORMAT_TOTAL_TIME_RUNNING;
  const auto counter = static_cast<int>(syscall(SYS_perf_event_open, &what, 0, -1, -1, PERF_FLAG_FD_CLOEXEC));
  if (counter < 0) return std::nullopt;
  ioctl(counter, PERF_EVENT_IOC_RESET, 0);
  ioctl(counter, PERF_EVENT_IOC_ENABLE, 0);
  work();
  ioctl(counter, PERF_EVENT_IOC_DISABLE, 0);
  struct {
    std::uint64_t count, enabled_ns, running_ns;
  } result{};
  const bool complete = read(counter, &result, sizeof result) == sizeof result;
  close(counter);
  // A multiplexed counter has counted only a part of the work.
  if (!complete || result.count == 0 || result.running_ns < result.enabled_ns) return std::nullopt;
  return result.count;
}

}  // namespace lightwell::eval
