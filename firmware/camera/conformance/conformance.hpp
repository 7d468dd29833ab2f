// The suite that every camera backend passes. In the backend's test:
//   using lightwell::conformance::CameraConformance;
//   INSTANTIATE_TEST_SUITE_P(Replay, CameraConformance, conformance::cameras({{"recording",
//   make_recording}}),
//                            conformance::name_of);
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "camera/conformance/checks.hpp"

namespace lightwell::conformance {

/// One test a check, named for the failure that it catches.
class CameraConformance : public ::testing::TestWithParam<BackendUnderTest> {};

/// The suite's values. A call, so that the linker takes the suite's tests out of their library.
[[nodiscard]] ::testing::internal::ParamGenerator<BackendUnderTest> cameras(const std::vector<BackendUnderTest>& all);

/// Names the tests after the cameras.
[[nodiscard]] std::string name_of(const ::testing::TestParamInfo<BackendUnderTest>& info);

void PrintTo(const BackendUnderTest& camera, std::ostream* out);

}  // namespace lightwell::conformance
