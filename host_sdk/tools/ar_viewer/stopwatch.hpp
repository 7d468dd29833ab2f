// Time that a part of a frame takes.
#pragma once

#include <chrono>

namespace lightwell::viewer {

/// Runs from its construction.
class Stopwatch {
 public:
  [[nodiscard]] double ms() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace lightwell::viewer
