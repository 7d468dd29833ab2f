// In builds without Embree, in place of field_geometry_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/field.hpp>

namespace lightwell::test {
namespace {

TEST(LightFieldWithoutGeometryTest, ABuildWithoutEmbreeSaysWhatIsMissing) {
  EXPECT_FALSE(field_has_geometry());
  LightField field = std::move(LightField::make().value());
  const std::vector<Vec3f> vertices = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  const std::vector<std::uint32_t> indices = {0, 1, 2};
  const Status refused = field.set_geometry({vertices, indices});
  EXPECT_EQ(refused.code(), StatusCode::failed_precondition);
  EXPECT_THAT(refused.message(), testing::HasSubstr("libembree-dev"));
}

}  // namespace
}  // namespace lightwell::test
