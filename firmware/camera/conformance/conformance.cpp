#include "camera/conformance/conformance.hpp"

#include <ostream>

namespace lightwell::conformance {

std::vector<Check> all_checks() {
  std::vector<Check> all;
  for (const std::vector<Check>& part : {frame_checks(), life_checks(), buffer_lifetime_checks()})
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

::testing::internal::ParamGenerator<CheckOfBackend> cameras(const std::vector<BackendUnderTest>& all) {
  std::vector<CheckOfBackend> tests;
  for (const BackendUnderTest& camera : all)
    for (const Check& check : all_checks()) tests.push_back({camera, check});
  return ::testing::ValuesIn(tests);
}

std::string name_of(const ::testing::TestParamInfo<CheckOfBackend>& info) {
  return info.param.camera.name + "_" + info.param.check.fault;
}

void PrintTo(const CheckOfBackend& tested, std::ostream* out) {
  *out << tested.camera.name << ", check " << tested.check.name;
}

// Tests may link this library without instantiating the suite.
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(CameraConformance);

TEST_P(CameraConformance, Check) {
  const auto& [camera, check] = GetParam();
  if (check.applies != nullptr && !check.applies(camera)) GTEST_SKIP() << "does not apply to this camera";
  const Violations violations = check.run(camera);
  // A fault often repeats in every frame: the first violations suffice.
  constexpr std::size_t kShown = 8;
  for (std::size_t i = 0; i < violations.size() && i < kShown; ++i) ADD_FAILURE() << violations[i];
  if (violations.size() > kShown) ADD_FAILURE() << "and " << violations.size() - kShown << " more like these";
}

}  // namespace lightwell::conformance
