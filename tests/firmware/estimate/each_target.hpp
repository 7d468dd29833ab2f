// The same statement on every vector unit that the kernels were compiled for and this machine has.
#pragma once

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <hwy/targets.h>

namespace lightwell::test {

/// Calls check(name) once a target, the kernels bound to it; afterwards they are bound to the best one again. The file
/// that includes this must be compiled with the kernels' own target flags (CMakeLists.txt): the list of targets is a
/// macro's.
template <class Check>
void on_each_target(Check&& check) {
  hwy::SetSupportedTargetsForTest(0);
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(target);
    check(hwy::TargetName(target));
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace lightwell::test
