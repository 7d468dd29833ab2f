// PlaneReader on streams with losses, duplicates, other orders and hostile messages.
#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/plane_appearance.hpp>
#include <lightwell/plane_codec.hpp>

#include "support/captured_planes.hpp"

namespace lightwell {
namespace {

using test::linear_plane;

constexpr HostTime kNow{1'000'000'000};
constexpr PlaneEncoderOptions kWithImages{.images = ImageRecipients::all_clients};
using Messages = std::vector<std::vector<std::byte>>;

Messages encoded(PlaneEncoder& encoder, const CapturedPlane& plane) {
  const auto messages = encoder.encode(plane, plane.info.mid_exposure);
  EXPECT_TRUE(messages.ok()) << messages.status().message();
  if (!messages.ok()) return {};
  return {messages->begin(), messages->end()};
}

/// Of several messages: 64 tiles of 4 KiB.
CapturedPlane large_plane() { return linear_plane(256, 60, 60); }

CapturedPlane brighter(CapturedPlane plane, float factor) {
  for (auto* list : {&plane.texture.radiance, &plane.lumisphere.radiance})
    for (Radiance& v : *list) v = v * factor;
  return plane;
}

TEST(PlaneReader, OrderAndDuplicatesDoNotMatter) {
  PlaneEncoder encoder(kWithImages);
  const CapturedPlane plane = large_plane();
  Messages all = encoded(encoder, plane);
  for (const auto& m : encoded(encoder, brighter(plane, 2))) all.push_back(m);
  ASSERT_GE(all.size(), 8U);
  std::mt19937 random(1);
  for (int round = 0; round < 5; ++round) {
    std::ranges::shuffle(all, random);
    PlaneReader reader;
    for (const auto& m : all) EXPECT_TRUE(reader.take(m, kNow).ok());
    for (const auto& m : all) EXPECT_TRUE(reader.take(m, kNow).ok());
    const PlaneAppearance now = reader.snapshot(kNow);
    EXPECT_EQ(now.validity(), Validity::valid);
    EXPECT_EQ(now.revision(), 2U);
    EXPECT_NEAR(now.diffuse({}).value.r, 2 * 0.5, 0.01);
    EXPECT_EQ(reader.stats().messages, 2 * all.size());
    EXPECT_EQ(reader.stats().refused, 0U);
  }
}

TEST(PlaneReader, LostMessagesAreNoticedAndOldDataAreNotCurrent) {
  PlaneEncoder encoder(kWithImages);
  CapturedPlane plane = large_plane();
  PlaneReader reader;
  for (const auto& m : encoded(encoder, plane)) ASSERT_TRUE(reader.take(m, kNow).ok());
  const PlaneAppearance first = reader.snapshot(kNow);
  EXPECT_EQ(first.validity(), Validity::valid);

  // Every message but the one with the middle of the texture.
  const Messages second = encoded(encoder, brighter(plane, 2));
  const PlaneTileLayout layout(256, 60, 60);
  const std::size_t middle = layout.tile_of(PlanePart::texture, 128 * 256 + 128);
  std::vector<std::byte> lost;
  for (const auto& m : second) {
    const auto update = decode_plane_update(m);
    if (std::ranges::any_of(update->tiles, [&](const PlaneTile& t) { return t.index == middle; }))
      lost = m;
    else
      ASSERT_TRUE(reader.take(m, kNow).ok());
  }
  ASSERT_FALSE(lost.empty());
  const PlaneAppearance now = reader.snapshot(kNow);
  EXPECT_EQ(now.validity(), Validity::stale);
  EXPECT_GT(now.missing_tiles(), 0U);
  EXPECT_EQ(now.diffuse({0.01, -0.01}).validity, Validity::stale);
  EXPECT_EQ(now.specular({0, 0, 1}).validity, Validity::valid) << "that part is complete";
  // A snapshot does not change.
  EXPECT_EQ(first.validity(), Validity::valid);
  EXPECT_NEAR(first.specular({0, 0, 1}).value.r, 0.1, 0.001);
  // The next message is enough to notice, even if none of the update before arrived.
  PlaneReader other;
  PlaneEncoder again(kWithImages);
  for (const auto& m : encoded(again, plane)) ASSERT_TRUE(other.take(m, kNow).ok());
  (void)encoded(again, brighter(plane, 2));
  for (const auto& m : encoded(again, brighter(plane, 2))) ASSERT_TRUE(other.take(m, kNow).ok());
  EXPECT_EQ(other.snapshot(kNow).validity(), Validity::stale);
  EXPECT_EQ(other.snapshot(kNow).radiance({}, {0, 0, 1}).validity, Validity::stale);
  // It comes late: all is there.
  EXPECT_TRUE(reader.take(lost, kNow).ok());
  EXPECT_EQ(reader.snapshot(kNow).validity(), Validity::valid);
  // Or it comes with the next key.
  plane.info.mid_exposure.ns += 20'000'000'000;
  for (const auto& m : encoded(again, brighter(plane, 2))) ASSERT_TRUE(other.take(m, kNow).ok());
  EXPECT_EQ(other.snapshot(kNow).validity(), Validity::valid);
}

TEST(PlaneReader, LateReaderWaitsForTheKeys) {
  PlaneEncoder encoder(kWithImages);
  CapturedPlane plane = large_plane();
  (void)encoded(encoder, plane);
  PlaneReader reader;
  plane.info.mid_exposure.ns += 1'000'000'000;
  for (const auto& m : encoded(encoder, plane)) ASSERT_TRUE(reader.take(m, kNow).ok());
  EXPECT_EQ(reader.snapshot(kNow).validity(), Validity::stale);
  const PlaneAnswer answer = reader.snapshot(kNow).radiance({}, {0, 0, 1});
  EXPECT_EQ(answer.validity, Validity::none);
  EXPECT_EQ(answer.value, Radiance{});
  std::vector<float> rgb(3, 7.0F);
  EXPECT_EQ(reader.snapshot(kNow).render({1, 1, 1, 1, 0, 0, {{}, {0, 0, 1}}}, PlaneLayers::all, rgb).validity,
            Validity::none);
  EXPECT_EQ(rgb[0], 7);
  EXPECT_EQ(reader.snapshot(kNow).guidance().seen, 0) << "what has not arrived counts as unseen";
  plane.info.mid_exposure.ns += 9'000'000'000;
  for (const auto& m : encoded(encoder, plane)) ASSERT_TRUE(reader.take(m, kNow).ok());
  EXPECT_EQ(reader.snapshot(kNow).validity(), Validity::valid);
  EXPECT_EQ(reader.snapshot(kNow).radiance({}, {0, 0, 1}).validity, Validity::valid);
  EXPECT_NEAR(reader.snapshot(kNow).guidance().seen, 1, 1e-12);
}

TEST(PlaneReader, SilenceMakesAnswersStale) {
  PlaneEncoder encoder({.images = ImageRecipients::all_clients, .key_interval = {2'000'000'000}});
  PlaneReader reader;
  for (const auto& m : encoded(encoder, linear_plane())) ASSERT_TRUE(reader.take(m, kNow).ok());
  const auto after = [&](std::int64_t ns) { return reader.snapshot({kNow.ns + ns}); };
  EXPECT_EQ(after(5'900'000'000).radiance({}, {0, 0, 1}).validity, Validity::valid);
  EXPECT_EQ(after(6'000'000'000).radiance({}, {0, 0, 1}).validity, Validity::stale);
  EXPECT_EQ(after(6'000'000'000).validity(), Validity::stale);
  EXPECT_EQ(after(6'000'000'000).age().ns, 6'000'000'000);
  EXPECT_EQ(after(-5).age().ns, 0);
}

TEST(PlaneReader, AnotherCaptureReplacesAndFormerOnesAreRefused) {
  PlaneEncoder encoder(kWithImages);
  CapturedPlane plane = linear_plane();
  const Messages old = encoded(encoder, plane);
  PlaneReader reader;
  ASSERT_TRUE(reader.take(old[0], kNow).ok());
  CapturedPlane next = linear_plane(32, 10, 5);
  next.info.capture = 7;
  for (const auto& m : encoded(encoder, next)) ASSERT_TRUE(reader.take(m, kNow).ok());
  EXPECT_EQ(reader.snapshot(kNow).texture_edge(), 32);
  EXPECT_EQ(reader.take(old[0], kNow).code(), StatusCode::invalid_argument);
  EXPECT_EQ(reader.snapshot(kNow).info().capture, 7U);
  EXPECT_EQ(reader.stats().refused, 1U);
}

TEST(PlaneReader, RefusesContradictionsAndKeepsWhatItHas) {
  PlaneEncoder encoder(kWithImages), other(kWithImages);
  const CapturedPlane plane = linear_plane();
  PlaneReader reader;
  for (const auto& m : encoded(encoder, plane)) ASSERT_TRUE(reader.take(m, kNow).ok());
  for (const auto& m : encoded(encoder, brighter(plane, 2))) ASSERT_TRUE(reader.take(m, kNow).ok());
  // The same capture from an encoder that began again: tiles fall back to an earlier revision.
  (void)encoded(other, plane);
  (void)encoded(other, plane);
  for (const auto& m : encoded(other, plane)) EXPECT_EQ(reader.take(m, kNow).code(), StatusCode::invalid_argument);
  // Other sizes.
  PlaneEncoder sizes(kWithImages);
  for (const auto& m : encoded(sizes, linear_plane(32))) EXPECT_FALSE(reader.take(m, kNow).ok());
  const std::byte garbage[3] = {std::byte{255}, std::byte{255}, std::byte{255}};
  EXPECT_EQ(reader.take(garbage, kNow).code(), StatusCode::data_loss);
  const PlaneAppearance now = reader.snapshot(kNow);
  EXPECT_EQ(now.validity(), Validity::valid);
  EXPECT_NEAR(now.diffuse({}).value.r, 1, 0.01);
}

/// Damaged messages between good ones: no answer out of range, and the good messages make it whole again.
TEST(PlaneReader, DamagedMessagesNeverGiveInvalidAnswers) {
  std::mt19937 random(2);
  PlaneEncoder encoder({.images = ImageRecipients::all_clients, .key_interval = {1'000'000}});
  CapturedPlane plane = linear_plane(40, 10, 6);
  PlaneReader reader;
  std::size_t accepted = 0;
  std::vector<float> rgb(3 * 16 * 16);
  for (int round = 0; round < 2000; ++round) {
    plane.info.mid_exposure.ns += 1'000'000'000;
    Messages messages = encoded(encoder, plane);
    std::vector<std::byte> damaged = messages[0];
    for (int k = 0; k < 1 + round % 3; ++k)
      damaged[random() % (round % 2 == 0 ? 150 : damaged.size())] = static_cast<std::byte>(random());
    if (round % 7 == 0) damaged.resize(random() % damaged.size());
    accepted += reader.take(damaged, kNow).ok() ? 1 : 0;
    const PlaneAppearance now = reader.snapshot(kNow);
    const PlaneAnswer answer = now.radiance({0.01, 0.02}, {0.1, 0.1, 0.4});
    ASSERT_TRUE(std::isfinite(answer.value.r + answer.value.g + answer.value.b));
    (void)now.render({16, 16, 20, 20, 8, 8, {{}, {0, 0, 0.4}}}, PlaneLayers::all, rgb);
    for (const float v : rgb) ASSERT_TRUE(std::isfinite(v));
    (void)now.guidance();
  }
  EXPECT_GT(accepted, 100U);
  PlaneReader fresh;
  for (const auto& m : encoded(encoder, plane)) EXPECT_TRUE(fresh.take(m, kNow).ok());
}

}  // namespace
}  // namespace lightwell
