// Selects the vector unit (Highway target) of the kernels in a measuring program, optionally limited to a smaller one.
// Code that the compiler vectorizes without Highway uses the baseline (SSE2 on x86-64) on every processor.
#pragma once

#include <string>
#include <string_view>

#include <lightwell/result.hpp>

namespace lightwell::bench {

/// "best": everything that this processor supports; "avx2", "sse4": at most that. Returns Highway's name of the target
/// that the kernels then use: "AVX3", "AVX2", "NEON". Applies to the whole process; call it before starting threads.
/// invalid_argument for another name or an unsupported unit; then nothing changes.
[[nodiscard]] Result<std::string> select_vector_unit(std::string_view name);

}  // namespace lightwell::bench
