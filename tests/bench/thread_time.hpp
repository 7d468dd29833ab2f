// The clock of timed programs whose work is one thread's.
#pragma once

#include <ctime>

namespace lightwell::bench {

/// Of this thread on a processor, ms: others that use the machine make it wait, which is not what is asked.
[[nodiscard]] inline double thread_time_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

}  // namespace lightwell::bench
