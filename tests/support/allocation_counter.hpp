// Counts heap allocations: replaces malloc and related functions in the whole program; operator new of all libraries
// calls them.
#pragma once

#include <cstddef>

namespace lightwell::test {

/// Number of allocations of the calling thread since its start.
[[nodiscard]] std::size_t allocations_of_this_thread();

/// Counts the allocations of all threads between construction and destruction. One object at a time.
class AllocationCount {
 public:
  AllocationCount();
  ~AllocationCount();
  AllocationCount(const AllocationCount&) = delete;
  AllocationCount& operator=(const AllocationCount&) = delete;

  [[nodiscard]] std::size_t value() const;
  /// Prints the call stack of the first allocation to stderr.
  static void print_first();
};

}  // namespace lightwell::test
