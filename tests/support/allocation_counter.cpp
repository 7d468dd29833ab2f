#include "support/allocation_counter.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <execinfo.h>

// glibc's own functions, under the names that it reserves for replacements of malloc.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}

namespace lightwell::test {
namespace {

// constinit and trivial: malloc is called before and after everything else.
constinit thread_local std::size_t of_this_thread = 0;
std::atomic<bool> counting{false};
std::atomic<std::size_t> count{0};
std::array<void*, 32> first_calls{};
int first_depth = 0;

void note() {
  ++of_this_thread;
  if (!counting.load(std::memory_order_relaxed)) return;
  if (count.fetch_add(1) == 0) first_depth = backtrace(first_calls.data(), static_cast<int>(first_calls.size()));
}

}  // namespace

AllocationCount::AllocationCount() {
  // The first call of backtrace() loads a library, which allocates.
  first_depth = backtrace(first_calls.data(), static_cast<int>(first_calls.size()));
  first_depth = 0;
  count = 0;
  counting = true;
}
AllocationCount::~AllocationCount() { counting = false; }

std::size_t allocations_of_this_thread() { return of_this_thread; }

std::size_t AllocationCount::value() const { return count; }

void AllocationCount::print_first() {
  counting = false;
  backtrace_symbols_fd(first_calls.data(), first_depth, 2);
}

}  // namespace lightwell::test

using lightwell::test::note;

extern "C" {

void* malloc(std::size_t size) noexcept {
  note();
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) noexcept {
  note();
  return __libc_calloc(n, size);
}
void* realloc(void* old, std::size_t size) noexcept {
  note();
  return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  note();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  note();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) noexcept {
  note();
  *out = __libc_memalign(alignment, size);
  return *out == nullptr ? ENOMEM : 0;
}

}  // extern "C"
