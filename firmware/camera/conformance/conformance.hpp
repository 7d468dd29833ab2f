// The conformance suite that every camera backend must pass. In the backend's test:
//   using lightwell::conformance::CameraConformance;
//   INSTANTIATE_TEST_SUITE_P(Replay, CameraConformance, conformance::cameras({{"recording", make_recording}}),
//                            conformance::name_of);
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "camera/conformance/checks.hpp"

namespace lightwell::conformance {

/// One test per check, named after the failure that it detects.
class CameraConformance : public ::testing::TestWithParam<BackendUnderTest> {};

/// Parameters of the suite. A function of this library, so that the linker includes the suite's tests.
[[nodiscard]] ::testing::internal::ParamGenerator<BackendUnderTest> cameras(const std::vector<BackendUnderTest>& all);

/// Test name suffix: the camera's name.
[[nodiscard]] std::string name_of(const ::testing::TestParamInfo<BackendUnderTest>& info);

void PrintTo(const BackendUnderTest& camera, std::ostream* out);

}  // namespace lightwell::conformance
