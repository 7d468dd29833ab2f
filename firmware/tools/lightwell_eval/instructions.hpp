// Counts the instructions that this thread executes in user space (hardware counter of perf_event_open).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

namespace lightwell::eval {

/// Instructions of `work`; nullopt if the counter is not available (perf_event_paranoid, a virtual machine, a
/// container).
[[nodiscard]] std::optional<std::uint64_t> count_instructions(const std::function<void()>& work);

}  // namespace lightwell::eval
