#include "bench/vector_unit.hpp"

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
  const std::string selected = hwy::TargetName(hwy::SupportedAndGeneratedTargets().front());
  // Highway 1.0.3: SupportedTargets() selects all targets that the processor has, disabled ones included.
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  return selected;
}

}  // namespace lightwell::bench
