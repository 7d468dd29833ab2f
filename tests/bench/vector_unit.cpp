#include "bench/vector_unit.hpp"

#include <algorithm>
#include <cstdint>

#include <hwy/highway.h>
#include <hwy/targets.h>

namespace lightwell::bench {

Result<std::string> select_vector_unit(std::string_view name) {
  const std::int64_t unit = name == "avx2" ? HWY_AVX2 : name == "sse4" ? HWY_SSE4 : 0;
  if (unit == 0 && name != "best")
    return Status(StatusCode::invalid_argument,
                  "unknown vector unit \"" + std::string(name) + "\": use best, avx2 or sse4");
  hwy::DisableTargets(0);
  if (unit != 0 && (hwy::SupportedTargets() & unit) == 0)
    return Status(StatusCode::invalid_argument, "this processor has no " + std::string(name) + ": use best");
  // Better targets have lower bits.
  if (unit != 0) hwy::DisableTargets(unit - 1);
  return std::string(hwy::TargetName(hwy::SupportedAndGeneratedTargets().front()));
}

Result<std::string> take_vector_option(int& argc, char** argv) {
  char** const end = argv + argc;
  char** const option = std::find(argv, end, std::string_view("--vector"));
  if (option == end) return select_vector_unit("best");
  if (option + 1 == end) return Status(StatusCode::invalid_argument, "--vector needs a value: best, avx2 or sse4");
  const std::string_view name = option[1];
  std::copy(option + 2, end, option);
  argc -= 2;
  return select_vector_unit(name);
}

}  // namespace lightwell::bench
