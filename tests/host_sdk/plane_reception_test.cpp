// Captured planes in the receiver of all links.
#include <gtest/gtest.h>

#include <lightwell/plane_codec.hpp>

#include "core/descriptor_receiver.hpp"
#include "support/captured_planes.hpp"

namespace lightwell::core {
namespace {

using Verdict = PlaneReplayProtection::Verdict;
using Messages = std::vector<std::vector<std::byte>>;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kCaptureTimeout = PlaneReplayProtection::kCaptureTimeout.ns;

class PlaneReceptionTest : public ::testing::Test {
 protected:
  static PlaneEncoder encoder() { return PlaneEncoder({.images = ImageRecipients::all_clients}); }
  static Messages encoded(PlaneEncoder& encoder, const CapturedPlane& plane) {
    const auto messages = encoder.encode(plane, {0});
    return {messages->begin(), messages->end()};
  }
  void receive(const Messages& messages, std::int64_t at_ns, const PlaneVerdictOf& verdict_of = {}) {
    for (const auto& message : messages) receiver_.receive_plane(message, {at_ns}, verdict_of);
  }
  [[nodiscard]] PlaneAppearance plane() const { return receiver_.plane({0}); }

  static Verdict always_same(const PlaneInfo&) { return Verdict::same_capture; }

  std::vector<std::vector<std::byte>> observed_;
  DescriptorReceiver receiver_{[this] {
    ProbeOptions options;
    options.on_plane = [this](const PlaneArrival& a) { observed_.emplace_back(a.bytes.begin(), a.bytes.end()); };
    return options;
  }()};
};

TEST_F(PlaneReceptionTest, PublishesCompleteStatesAndShowsValidMessages) {
  PlaneEncoder from = encoder();
  const Messages messages = encoded(from, test::linear_plane(256, 60, 60));
  ASSERT_GT(messages.size(), 2U);
  receiver_.receive_plane(messages[0], {0});
  EXPECT_EQ(plane().validity(), Validity::none) << "the update is incomplete";
  receiver_.receive_plane(std::vector<std::byte>(5, std::byte{0xFF}), {0});
  EXPECT_EQ(receiver_.stats().undecodable, 1U);
  receive({messages.begin() + 1, messages.end()}, 0);
  EXPECT_EQ(plane().validity(), Validity::valid);
  EXPECT_EQ(observed_, messages);
}

TEST_F(PlaneReceptionTest, VerdictsAreFollowed) {
  PlaneEncoder from = encoder();
  const CapturedPlane some = test::linear_plane();
  receive(encoded(from, some), 0, [](const PlaneInfo&) { return Verdict::refused; });
  EXPECT_EQ(receiver_.stats().untimely, 1U);
  EXPECT_EQ(plane().validity(), Validity::none);
  EXPECT_TRUE(observed_.empty());
  receive(encoded(from, some), 0, [&](const PlaneInfo& info) {
    EXPECT_EQ(info, some.info);
    return Verdict::other_capture;
  });
  EXPECT_EQ(plane().revision(), 0U) << "changes without tiles are no plane";
  PlaneEncoder anew = encoder();
  receive(encoded(anew, some), 0, [](const PlaneInfo&) { return Verdict::other_capture; });
  EXPECT_EQ(plane().revision(), 1U);
}

/// A forged message of the probe's own capture, with the highest revision: the probe's messages are older from then on.
TEST_F(PlaneReceptionTest, AForgedRevisionDoesNotLast) {
  PlaneEncoder from = encoder(), forger = encoder();
  CapturedPlane genuine = test::linear_plane(), forged = genuine;
  receive(encoded(from, genuine), 0, always_same);
  for (int k = 0; k < 20; ++k) {
    for (Radiance& v : forged.texture.radiance) v = v * 1.1F;
    (void)encoded(forger, forged);
  }
  const auto whole = forger.whole();
  receive({whole.begin(), whole.end()}, kSecond, always_same);
  ASSERT_EQ(plane().revision(), 20U);
  const auto repeated = [&](std::int64_t at_ns) {
    (void)encoded(from, genuine);
    const auto all = from.whole();
    receive({all.begin(), all.end()}, at_ns, always_same);
    return plane().revision();
  };
  EXPECT_EQ(repeated(kSecond + kCaptureTimeout), 20U);
  EXPECT_EQ(repeated(kSecond + kCaptureTimeout + 1), 3U) << "collected anew";
  EXPECT_NEAR(plane().diffuse({}).value.r, 0.5, 0.003);
}

/// A link that delivers the probe's messages alone needs no such limit: a pause does not cost the plane.
TEST_F(PlaneReceptionTest, WithoutVerdictsAPauseChangesNothing) {
  PlaneEncoder from = encoder();
  CapturedPlane plane_now = test::linear_plane();
  receive(encoded(from, plane_now), 0);
  plane_now.texture.radiance[0] = {9, 9, 9};
  receive(encoded(from, plane_now), 10 * kCaptureTimeout);
  EXPECT_EQ(plane().revision(), 2U);
  EXPECT_EQ(plane().missing_tiles(), 0U);
}

}  // namespace
}  // namespace lightwell::core
