// Memory of this process, from Linux's /proc.
#pragma once

#include <algorithm>
#include <fstream>
#include <malloc.h>
#include <string>
#include <string_view>

namespace lightwell::bench {

/// Growth of resident memory since the object was made, at its peak during measured calls. Memory that was in use
/// only between them does not count. Of one thread at a time.
class PeakMemory {
 public:
  PeakMemory() {
    malloc_trim(0);
    start_ = peak_ = megabytes("VmRSS:");
  }
  template <class Call>
  void measure(const Call& call) {
    malloc_trim(0);
    std::ofstream("/proc/self/clear_refs") << "5";  // Sets VmHWM to VmRSS (proc(5)).
    call();
    peak_ = std::max(peak_, megabytes("VmHWM:"));
  }
  /// MB (1e6 bytes).
  [[nodiscard]] double growth_mb() const { return peak_ - start_; }

 private:
  [[nodiscard]] static double megabytes(std::string_view key) {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with(key)) return std::stod(line.substr(key.size())) * 1024 / 1e6;
    return 0;
  }
  double start_ = 0, peak_ = 0;
};

}  // namespace lightwell::bench
