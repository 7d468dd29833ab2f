// Instructions that this thread executes in user space, counted by the processor.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

namespace lightwell::eval {

/// Of `work` alone; none where the kernel or the machine does not count (perf_event_paranoid, a virtual machine, a
/// container).
[[nodiscard]] std::optional<std::uint64_t> count_instructions(const std::function<void()>& work);

}  // namespace lightwell::eval
