// Runs a test on every Highway target that the kernels were compiled for and this machine supports.
#pragma once

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <hwy/targets.h>

namespace lightwell::test {

/// Calls check(name) for each target with the kernels bound to it, then binds them to the best one again. The including
/// file must be compiled with the kernels' target flags (CMakeLists.txt), because the list of targets is a macro.
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
