// Which vectors a measured program's kernels use (Highway's targets), limited to those of a lesser processor on
// request. What a compiler vectorises without Highway is of the baseline (SSE2 on x86-64) on every processor.
#pragma once

#include <string>
#include <string_view>

#include <lightwell/result.hpp>

namespace lightwell::bench {

/// "best": all that this processor has; "avx2", "sse4": nothing better. Returns the target that the kernels use from
/// then on, by Highway's name: "AVX3_DL", "AVX2", "NEON". Of the whole process: before any other thread is started.
/// invalid_argument where the name is none of these or the processor lacks the unit; then nothing changes.
[[nodiscard]] Result<std::string> select_vector_unit(std::string_view name);

/// Takes `--vector NAME` out of a program's arguments and selects it; "best" where it is not among them.
[[nodiscard]] Result<std::string> take_vector_option(int& argc, char** argv);

}  // namespace lightwell::bench
