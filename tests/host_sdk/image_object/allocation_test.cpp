// ObjectRelighter in the render loop.
#include <gtest/gtest.h>

#include <lightwell/image_object.hpp>

#include "host_sdk/image_object/matte_ball.hpp"
#include "support/allocation_counter.hpp"

namespace lightwell::test {
namespace {

TEST(ObjectRelighter, AllocatesNothingAfterItsFirstCall) {
  const ObjectView view = view_of(Ball());
  ObjectRelighter relighter;
  std::vector<Radiance> out(view.coverage().size());
  std::vector<ObjectLight> lights(9, ObjectLight{{0.2F, 0.3F, 1}, {1, 1, 1}});
  ASSERT_TRUE(relighter.relight(view, lights, LightInterpolation::smooth, out).ok());
  lights.resize(5, ObjectLight{{1, 0, 1}, {1, 1, 1}});
  const AllocationCount count;
  const bool done = relighter.relight(view, lights, LightInterpolation::smooth, out).ok();
  EXPECT_EQ(count.value(), 0U);
  EXPECT_TRUE(done);
}

}  // namespace
}  // namespace lightwell::test
