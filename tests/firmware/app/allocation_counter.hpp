// Counts what is taken from the heap: malloc and its relatives are replaced in the whole program,
// and operator new of every library comes to them.
#pragma once

#include <cstddef>

namespace lightwell::test {

/// From construction to destruction, of all threads. One at a time.
class AllocationCount {
 public:
  AllocationCount();
  ~AllocationCount();
  AllocationCount(const AllocationCount&) = delete;
  AllocationCount& operator=(const AllocationCount&) = delete;

  [[nodiscard]] std::size_t value() const;
  /// The calls that led to the first one, on stderr: what a failing test wants to show.
  static void print_first();
};

}  // namespace lightwell::test
