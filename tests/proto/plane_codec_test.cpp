// Encoding of captured planes: what a reader gets, what is sent again, and who gets images.
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/bytes.hpp>
#include <lightwell/plane_codec.hpp>

#include "golden_vectors.hpp"
#include "support/captured_planes.hpp"
#include "support/read_file.hpp"

namespace lightwell {
namespace {

using test::linear_plane;

constexpr PlaneEncoderOptions kWithImages{.images = ImageRecipients::all_clients};

std::vector<PlaneUpdate> decoded(std::span<const std::vector<std::byte>> messages) {
  std::vector<PlaneUpdate> out;
  for (const auto& bytes : messages) {
    EXPECT_LE(bytes.size(), kMaxPlaneMessageBytes);
    Result<PlaneUpdate> update = decode_plane_update(bytes);
    EXPECT_TRUE(update.ok()) << update.status().message();
    if (update.ok()) out.push_back(std::move(*update));
  }
  return out;
}

std::vector<PlaneUpdate> encoded(PlaneEncoder& encoder, const CapturedPlane& plane, ProbeTime now = {5'000'000'000}) {
  const auto messages = encoder.encode(plane, now);
  EXPECT_TRUE(messages.ok()) << messages.status().message();
  return messages.ok() ? decoded(*messages) : std::vector<PlaneUpdate>();
}

std::size_t tile_count(const std::vector<PlaneUpdate>& updates) {
  std::size_t out = 0;
  for (const PlaneUpdate& u : updates) out += u.tiles.size();
  return out;
}

/// The arrays that a reader of every tile holds.
struct Held {
  std::vector<Radiance> texture, lumisphere;
  std::vector<SampleState> texture_state, lumisphere_state, coverage;

  explicit Held(const CapturedPlane& sizes)
      : texture(sizes.texture.count()),
        lumisphere(sizes.lumisphere.grid.size()),
        texture_state(texture.size()),
        lumisphere_state(lumisphere.size()),
        coverage(sizes.coverage.grid.size()) {}

  void take(const std::vector<PlaneUpdate>& updates) {
    for (const PlaneUpdate& u : updates)
      for (const PlaneTile& tile : u.tiles)
        for (std::size_t k = 0; k < tile.state.size(); ++k) {
          const std::size_t at = u.layout.entry(tile.index, k);
          const PlanePart part = u.layout.part(tile.index);
          EXPECT_EQ(u.layout.tile_of(part, at), tile.index);
          if (part == PlanePart::coverage) {
            coverage[at] = tile.state[k];
            continue;
          }
          (part == PlanePart::texture ? texture : lumisphere)[at] = tile.radiance[k];
          (part == PlanePart::texture ? texture_state : lumisphere_state)[at] = tile.state[k];
        }
  }
};

/// Each channel within `step` of the entry's largest channel, or of a thousandth of the largest entry.
void expect_within(const std::vector<Radiance>& held, const std::vector<Radiance>& truth, float step) {
  float most = 0;
  for (const Radiance& v : truth) most = std::max({most, v.r, v.g, v.b});
  ASSERT_EQ(held.size(), truth.size());
  for (std::size_t i = 0; i < held.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const float tolerance = step * std::max({truth[i].r, truth[i].g, truth[i].b, 1e-3F * most});
      ASSERT_NEAR(held[i][c], std::max(truth[i][c], 0.0F), tolerance) << i;
    }
}

CapturedPlane random_plane(std::mt19937& random, int edge = 70, int levels = 30) {
  CapturedPlane p = linear_plane(edge, levels, 12);
  std::uniform_real_distribution<float> uniform;
  std::uniform_int_distribution<int> state(0, 2);
  for (auto* list : {&p.texture.radiance, &p.lumisphere.radiance})
    for (Radiance& v : *list) v = {std::exp(9 * uniform(random) - 6), uniform(random) - 0.1F, uniform(random)};
  for (auto* list : {&p.texture.state, &p.lumisphere.state})
    for (SampleState& s : *list) s = static_cast<SampleState>(state(random));
  for (std::uint8_t& s : p.coverage.seen) s = state(random) == 0 ? 1 : 0;
  return p;
}

TEST(PlaneCodec, RoundTripsEveryField) {
  std::mt19937 random(1);
  CapturedPlane plane = random_plane(random);
  plane.info.units = Units::absolute;
  plane.info.T_probe_plane = Pose{Quat{0.5, 0.5, 0.5, 0.5}, {0.1, -0.2, -0.6}};
  plane.info.texture_to_plane = {0.001, -0.002, 0.01, 1.003};
  plane.info.gloss_alpha = 0.1F;
  plane.info.f0 = 0.04F;
  PlaneEncoder encoder({.images = ImageRecipients::all_clients, .key_interval = {3'000'000'000}});
  const auto updates = encoded(encoder, plane);
  ASSERT_FALSE(updates.empty());
  for (const PlaneUpdate& u : updates) {
    EXPECT_EQ(u.info, plane.info);
    EXPECT_EQ(u.revision, 1U);
    EXPECT_EQ(u.key_interval.ns, 3'000'000'000);
    EXPECT_EQ(u.layout, PlaneTileLayout(70, 30, 12));
  }
  Held held(plane);
  held.take(updates);
  // Directly after it was sent, only RGB9E5 rounds.
  expect_within(held.texture, plane.texture.radiance, 1.0F / 512);
  expect_within(held.lumisphere, plane.lumisphere.radiance, 1.0F / 512);
  EXPECT_EQ(held.texture_state, plane.texture.state);
  EXPECT_EQ(held.lumisphere_state, plane.lumisphere.state);
  for (std::size_t n = 0; n < held.coverage.size(); ++n)
    EXPECT_EQ(held.coverage[n] != SampleState::unseen, plane.coverage.seen[n] != 0);
}

TEST(PlaneCodec, LargestPlaneIsDividedIntoMessages) {
  std::mt19937 random(2);
  CapturedPlane plane = random_plane(random, kMaxPlaneTextureEdge, kMaxPlaneLevels);
  plane.coverage.grid = HemisphereGrid(kMaxPlaneLevels);
  plane.coverage.seen.assign(plane.coverage.grid.size(), 1);
  PlaneEncoder encoder(kWithImages);
  const auto updates = encoded(encoder, plane);
  EXPECT_EQ(tile_count(updates), 64U + 33 + 5);
  EXPECT_GE(updates.size(), 7U);
  Held held(plane);
  held.take(updates);
  expect_within(held.texture, plane.texture.radiance, 1.0F / 512);
}

TEST(PlaneCodec, RangeOfFloatsSurvives) {
  for (const float scale : {1e-35F, 1e-20F, 1.0F, 1e20F, 1e29F}) {
    CapturedPlane plane = linear_plane();
    for (Radiance& v : plane.lumisphere.radiance) v = v * scale;
    PlaneEncoder encoder;
    Held held(plane);
    held.take(encoded(encoder, plane));
    expect_within(held.lumisphere, plane.lumisphere.radiance, 1.0F / 512);
  }
}

TEST(PlaneCodec, NothingIsSentOfAnUnseenPlane) {
  CapturedPlane plane = linear_plane();
  for (auto* list : {&plane.texture.radiance, &plane.lumisphere.radiance}) std::ranges::fill(*list, Radiance{});
  for (auto* list : {&plane.texture.state, &plane.lumisphere.state}) std::ranges::fill(*list, SampleState::unseen);
  std::ranges::fill(plane.coverage.seen, std::uint8_t{0});
  PlaneEncoder encoder(kWithImages);
  const auto updates = encoded(encoder, plane);
  ASSERT_EQ(updates.size(), 1U);
  EXPECT_TRUE(updates[0].tiles.empty());
  EXPECT_TRUE(std::ranges::all_of(updates[0].tile_revision, [](std::uint64_t r) { return r == 0; }));
}

TEST(PlaneCodec, OnlyTilesThatChangedBeyondTheStepAreSentAgain) {
  CapturedPlane plane = linear_plane();
  PlaneEncoder encoder({.images = ImageRecipients::all_clients, .step = 0.05F});
  const std::size_t all = tile_count(encoded(encoder, plane));
  EXPECT_EQ(all, 4U + 1 + 1);
  EXPECT_EQ(tile_count(encoded(encoder, plane)), 0U);
  plane.texture.radiance[64 * 40 + 50].r *= 1.03F;
  EXPECT_EQ(tile_count(encoded(encoder, plane)), 0U);
  plane.texture.radiance[64 * 40 + 50].r *= 1.1F;
  auto updates = encoded(encoder, plane);
  ASSERT_EQ(tile_count(updates), 1U);
  EXPECT_EQ(updates[0].tiles[0].index, 3U);
  EXPECT_EQ(updates[0].tile_revision[3], 4U);
  EXPECT_EQ(updates[0].tile_revision[2], 1U);
  plane.lumisphere.state[7] = SampleState::clipped;
  EXPECT_EQ(tile_count(encoded(encoder, plane)), 1U);
  plane.coverage.seen[7] = 0;
  EXPECT_EQ(tile_count(encoded(encoder, plane)), 1U);
}

/// Whatever changes: a reader of all messages is never further from the plane than the step.
TEST(PlaneCodec, ReaderStaysWithinTheStep) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> factor(0.97F, 1.03F);
  CapturedPlane plane = random_plane(random);
  PlaneEncoder encoder({.images = ImageRecipients::all_clients, .step = 0.1F});
  Held held(plane);
  for (int update = 0; update < 40; ++update) {
    held.take(encoded(encoder, plane));
    expect_within(held.texture, plane.texture.radiance, 0.1F);
    expect_within(held.lumisphere, plane.lumisphere.radiance, 0.1F);
    for (auto* list : {&plane.texture.radiance, &plane.lumisphere.radiance})
      for (Radiance& v : *list) v = v * factor(random);
  }
}

/// By the time of the calls: mid_exposure stays while no frame contributes.
TEST(PlaneCodec, TilesAreRepeatedAfterTheKeyInterval) {
  const CapturedPlane plane = linear_plane();
  PlaneEncoder encoder({.images = ImageRecipients::all_clients, .key_interval = {1'000'000'000}});
  ProbeTime now{8'000'000'000};
  const std::size_t all = tile_count(encoded(encoder, plane, now));
  const auto after = [&](std::int64_t ns) {
    now.ns += ns;
    return encoded(encoder, plane, now);
  };
  EXPECT_EQ(tile_count(after(900'000'000)), 0U);
  const auto repeated = after(100'000'000);
  EXPECT_EQ(tile_count(repeated), all);
  // Their content did not change, and their revision says so.
  EXPECT_EQ(repeated[0].tile_revision[0], 1U);
  EXPECT_EQ(tile_count(after(1'000'000)), 0U);
  // The plane's own time has no influence.
  CapturedPlane later = plane;
  later.info.mid_exposure.ns += 3'600'000'000'000;
  EXPECT_EQ(tile_count(encoded(encoder, later, now)), 0U);
  EXPECT_EQ(tile_count(after(999'000'000)), all);
  // A clock that was set back.
  EXPECT_EQ(tile_count(after(-3'600'000'000'000)), all);
}

TEST(PlaneCodec, WholeIsWhatReadersOfAllMessagesHold) {
  std::mt19937 random(6);
  CapturedPlane plane = random_plane(random);
  PlaneEncoder encoder(kWithImages);
  EXPECT_TRUE(encoder.whole().empty());
  Held all(plane), late(plane);
  all.take(encoded(encoder, plane));
  plane.texture.radiance[0].r *= 2;
  plane.lumisphere.radiance[3].r *= 1.001F;
  const auto changes = encoded(encoder, plane);
  all.take(changes);
  EXPECT_EQ(tile_count(changes), 1U);
  const auto whole = decoded(encoder.whole());
  late.take(whole);
  EXPECT_EQ(whole[0].revision, 2U);
  EXPECT_EQ(whole[0].tile_revision, changes[0].tile_revision);
  EXPECT_EQ(late.texture, all.texture);
  EXPECT_EQ(late.lumisphere, all.lumisphere);
  EXPECT_EQ(late.coverage, all.coverage);
  // Changes nothing.
  EXPECT_EQ(tile_count(encoded(encoder, plane)), 0U);
}

/// The texture is a photograph. Nothing of it leaves the probe, whatever is in it, unless that is allowed.
TEST(PlaneCodec, NoMessageHasATexelUnlessImagesAreAllowed) {
  EXPECT_EQ(PlaneEncoderOptions{}.images, ImageRecipients::nobody);
  // No other entry is near this value.
  constexpr Radiance kMark{123.0F, 17.0F, 3.0F};
  const auto marked = [&](const Radiance& v) {
    return std::abs(v.r - kMark.r) < 12 && std::abs(v.g - kMark.g) < 2 && std::abs(v.b - kMark.b) < 1;
  };
  for (const ImageRecipients images : {ImageRecipients::nobody, ImageRecipients::all_clients}) {
    std::mt19937 random(4);
    PlaneEncoder encoder({.images = images});
    std::size_t entries = 0, texels = 0;
    for (int update = 0; update < 5; ++update) {
      CapturedPlane plane = random_plane(random);
      std::ranges::fill(plane.texture.radiance, kMark);
      auto updates = encoded(encoder, plane, {20'000'000'000LL * update});
      for (PlaneUpdate& u : decoded(encoder.whole())) updates.push_back(std::move(u));
      for (const PlaneUpdate& u : updates) {
        EXPECT_EQ(u.layout, PlaneTileLayout(images == ImageRecipients::nobody ? 0 : 70, 30, 12));
        for (const PlaneTile& tile : u.tiles) {
          entries += tile.state.size();
          texels += static_cast<std::size_t>(std::ranges::count_if(tile.radiance, marked));
          EXPECT_TRUE(images == ImageRecipients::all_clients || u.layout.part(tile.index) != PlanePart::texture);
        }
      }
    }
    EXPECT_GT(entries, 10'000U);
    // Every update and every whole() of it has all texels: the comparison finds them where they are.
    EXPECT_EQ(texels, images == ImageRecipients::nobody ? 0U : 2U * 5 * 70 * 70);
  }
}

TEST(PlaneCodec, AnotherCaptureBeginsAgainAndOtherSizesNeedOne) {
  CapturedPlane plane = linear_plane();
  PlaneEncoder encoder(kWithImages);
  const std::size_t all = tile_count(encoded(encoder, plane));
  const CapturedPlane larger = linear_plane(96);
  EXPECT_EQ(encoder.encode(larger, {}).status().code(), StatusCode::failed_precondition);
  ++plane.info.capture;
  const auto updates = encoded(encoder, plane);
  EXPECT_EQ(tile_count(updates), all);
  EXPECT_EQ(updates[0].revision, 2U);
}

/// Version 1 is frozen: these bytes must stay decodable, to these values.
TEST(PlaneCodec, GoldenMessageOfVersion1) {
  const CapturedPlane plane = golden_plane();
  PlaneEncoder encoder(kWithImages);
  const auto messages = encoder.encode(plane, {});
  ASSERT_TRUE(messages.ok());
  ASSERT_EQ(messages->size(), 1U);
  const std::vector<std::byte>& made = messages->front();
  const std::string file = test::read_file(std::string(LIGHTWELL_VECTORS) + "/captured_plane/v1_small.bin");
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(made.data()), made.size()), file)
      << "run make_golden_vectors proto/vectors and look at the difference";
  EXPECT_EQ(crc32c(std::as_bytes(std::span(file))), 0x2314462bU);
  const auto update = decode_plane_update(std::as_bytes(std::span(file)));
  ASSERT_TRUE(update.ok());
  EXPECT_EQ(update->info, plane.info);
  ASSERT_EQ(update->tiles.size(), 3U);
  EXPECT_EQ(update->tiles[0].state[17], SampleState::clipped);
  EXPECT_EQ(update->tiles[1].state[40], SampleState::unseen);
  EXPECT_EQ(update->tiles[2].state[24], SampleState::unseen);
  EXPECT_EQ(update->tiles[2].state[23], SampleState::measured);
  // Texel 0 is at x = -0.0916667, y = 0.0916667 m.
  EXPECT_NEAR(update->tiles[0].radiance[0].r, 0.316667, 0.316667 / 512);
}

}  // namespace
}  // namespace lightwell
