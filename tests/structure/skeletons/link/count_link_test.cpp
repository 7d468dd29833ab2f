// The result of "A link" in CONTRIBUTING.md. Steps 1 and 2 are count_link; step 3 is the target of this test, with the
// link in it; step 6 is the comment of make_count_link().
#include "structure/skeletons/link/count_link.hpp"

#include <gtest/gtest.h>

#include "link/link.hpp"
#include "support/fake_commands.hpp"

namespace lightwell {
namespace {

// Step 5: a descriptor from a Publisher.
TEST(CountLink, CountsWhatThePublisherSends) {
  test::FakeCommands commands;
  Publisher publisher;
  // Step 4: what add_links() does.
  std::unique_ptr<CountLink> made = make_count_link({"here"}, commands);
  const CountLink& link = *made;
  publisher.add(std::move(made));
  ASSERT_TRUE(publisher.start().ok());
  EXPECT_EQ(link.address(), "count://here");
  Descriptor descriptor;
  const Status published = publisher.publish(descriptor);
  ASSERT_TRUE(published.ok()) << published.message();
  EXPECT_EQ(link.count(), 1U);
  publisher.stop();
}

}  // namespace
}  // namespace lightwell
