// Clock for measuring single-threaded work.
#pragma once

#include <ctime>

namespace lightwell::bench {

/// CPU time of this thread in ms, which does not include waiting for other processes.
[[nodiscard]] inline double thread_time_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

}  // namespace lightwell::bench
