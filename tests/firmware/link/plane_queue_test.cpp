#include "link/plane_queue.hpp"

#include <gtest/gtest.h>

#include "support/plane_messages.hpp"

namespace lightwell::test {
namespace {

TEST(PlaneQueue, SendsTheWholePlaneAndThenChanges) {
  PlaneQueue queue;
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.take(), nullptr);
  queue.put(plane_update(1, 1, 2));
  EXPECT_EQ(plane_name(queue.take()), "whole1.0");
  EXPECT_FALSE(queue.empty());
  EXPECT_EQ(plane_name(queue.take()), "whole1.1");
  EXPECT_TRUE(queue.empty());
  queue.put(plane_update(2, 2, 2));
  EXPECT_EQ(plane_name(queue.take()), "change2.0");
  // It is begun, so it is finished.
  queue.put(plane_update(3, 1, 2));
  EXPECT_EQ(plane_name(queue.take()), "change2.1");
  EXPECT_EQ(plane_name(queue.take()), "change3.0");
  EXPECT_EQ(queue.take(), nullptr);
  EXPECT_EQ(queue.replaced(), 0U);
}

TEST(PlaneQueue, AfterAReplacedUpdateTheNewestIsSentWhole) {
  PlaneQueue queue;
  queue.put(plane_update(1, 1, 1));
  EXPECT_EQ(plane_name(queue.take()), "whole1.0");
  queue.put(plane_update(2, 2, 3));
  EXPECT_EQ(plane_name(queue.take()), "change2.0");
  queue.put(plane_update(3, 1, 3));
  queue.put(plane_update(4, 1, 3));
  EXPECT_EQ(queue.replaced(), 1U);
  EXPECT_EQ(plane_name(queue.take()), "change2.1");
  EXPECT_EQ(plane_name(queue.take()), "whole4.0");
}

TEST(PlaneQueue, AfterALossOrANewClientTheNextIsSentWhole) {
  PlaneQueue queue;
  queue.put(plane_update(1, 1, 1));
  (void)queue.take();
  queue.require_whole();
  queue.put(plane_update(2, 1, 2));
  EXPECT_EQ(plane_name(queue.take()), "whole2.0");
  queue.clear();
  EXPECT_TRUE(queue.empty());
  queue.put(plane_update(3, 1, 1));
  EXPECT_EQ(plane_name(queue.take()), "whole3.0");
}

TEST(PlaneQueue, AMessageKeepsItsUpdateAlive) {
  PlaneQueue queue;
  queue.put(plane_update(1, 1, 1));
  const EncodedMessage message = queue.take();
  queue.clear();
  EXPECT_EQ(plane_name(message), "whole1.0");
}

}  // namespace
}  // namespace lightwell::test
