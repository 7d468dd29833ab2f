// Encoding of captured planes: what a reader gets, what is sent again, who gets images, and rejection of hostile bytes.
#include <algorithm>
#include <functional>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/bytes.hpp>
#include <lightwell/plane_codec.hpp>

#include "golden_vectors.hpp"
#include "lightwell/v1/captured_plane.pb.h"
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

std::vector<PlaneUpdate> encoded(PlaneEncoder& encoder, const CapturedPlane& plane) {
  const auto messages = encoder.encode(plane);
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

TEST(PlaneCodec, TilesAreRepeatedAfterTheKeyInterval) {
  CapturedPlane plane = linear_plane();
  PlaneEncoder encoder({.images = ImageRecipients::all_clients, .key_interval = {1'000'000'000}});
  const std::size_t all = tile_count(encoded(encoder, plane));
  const auto after = [&](std::int64_t ns) {
    plane.info.mid_exposure.ns += ns;
    return encoded(encoder, plane);
  };
  EXPECT_EQ(tile_count(after(900'000'000)), 0U);
  const auto repeated = after(100'000'000);
  EXPECT_EQ(tile_count(repeated), all);
  // Their content did not change, and their revision says so.
  EXPECT_EQ(repeated[0].tile_revision[0], 1U);
  EXPECT_EQ(tile_count(after(1'000'000)), 0U);
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
  std::mt19937 random(4);
  PlaneEncoder encoder;
  EXPECT_EQ(PlaneEncoderOptions{}.images, ImageRecipients::nobody);
  for (int update = 0; update < 5; ++update) {
    CapturedPlane plane = random_plane(random);
    plane.info.mid_exposure.ns = 20'000'000'000LL * update;
    // No other entry has this value.
    std::ranges::fill(plane.texture.radiance, Radiance{123.0F, 17.0F, 3.0F});
    const auto messages = encoder.encode(plane);
    ASSERT_TRUE(messages.ok());
    for (const auto& bytes : *messages) {
      v1::PlaneUpdate m;
      ASSERT_TRUE(m.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
      EXPECT_EQ(m.texture_edge(), 0U);
      const PlaneTileLayout layout(0, 30, 12);
      EXPECT_EQ(static_cast<std::size_t>(m.tile_revision_size()), layout.size());
      for (const v1::PlaneTile& tile : m.tiles()) {
        ASSERT_LT(tile.index(), layout.size());
        EXPECT_NE(layout.part(tile.index()), PlanePart::texture);
      }
    }
  }
}

TEST(PlaneCodec, AnotherCaptureBeginsAgainAndOtherSizesNeedOne) {
  CapturedPlane plane = linear_plane();
  PlaneEncoder encoder(kWithImages);
  const std::size_t all = tile_count(encoded(encoder, plane));
  const CapturedPlane larger = linear_plane(96);
  EXPECT_EQ(encoder.encode(larger).status().code(), StatusCode::failed_precondition);
  ++plane.info.capture;
  const auto updates = encoded(encoder, plane);
  EXPECT_EQ(tile_count(updates), all);
  EXPECT_EQ(updates[0].revision, 2U);
}

TEST(PlaneCodec, RefusesPlanesOutOfRange) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  struct Refusal {
    const char* name;
    std::function<void(CapturedPlane&)> spoil;
  };
  const std::vector<Refusal> refusals = {
      {"capture", [](CapturedPlane& p) { p.info.capture = 0; }},
      {"units", [](CapturedPlane& p) { p.info.units = static_cast<Units>(3); }},
      {"size_m", [](CapturedPlane& p) { p.info.size_m = 0; }},
      {"size_m", [=](CapturedPlane& p) { p.info.size_m = static_cast<double>(nan); }},
      {"unit quaternion",
       [](CapturedPlane& p) {
         p.info.T_probe_plane = Pose{{1, 1, 0, 0}, {}};
       }},
      {"tx, ty, tz",
       [=](CapturedPlane& p) {
         p.info.T_probe_plane = Pose{{}, {0, 0, static_cast<double>(nan)}};
       }},
      {"texture_to_plane", [](CapturedPlane& p) { p.info.texture_to_plane.scale = 0; }},
      {"texture_to_plane", [=](CapturedPlane& p) { p.info.texture_to_plane.x_m = static_cast<double>(infinity); }},
      {"gloss_alpha", [=](CapturedPlane& p) { p.info.gloss_alpha = nan; }},
      {"f0", [](CapturedPlane& p) { p.info.f0 = 1.5F; }},
      {"texture.edge", [](CapturedPlane& p) { p.texture.edge = 257; }},
      {"texture.edge", [](CapturedPlane& p) { p.texture.edge = -1; }},
      {"texture: the arrays", [](CapturedPlane& p) { p.texture.state.pop_back(); }},
      {"texture: a radiance", [=](CapturedPlane& p) { p.texture.radiance[3].g = nan; }},
      {"texture: a state", [](CapturedPlane& p) { p.texture.state[3] = static_cast<SampleState>(3); }},
      {"lumisphere: a radiance", [=](CapturedPlane& p) { p.lumisphere.radiance[3].b = infinity; }},
      {"lumisphere: more", [](CapturedPlane& p) { p.lumisphere.grid = HemisphereGrid(129); }},
      {"coverage: more", [](CapturedPlane& p) { p.coverage.grid = HemisphereGrid(129); }},
      {"coverage: the array", [](CapturedPlane& p) { p.coverage.seen.clear(); }},
  };
  for (const Refusal& r : refusals) {
    CapturedPlane plane = linear_plane();
    r.spoil(plane);
    PlaneEncoder encoder(kWithImages);
    const Status s = encoder.encode(plane).status();
    EXPECT_EQ(s.code(), StatusCode::invalid_argument) << r.name;
    EXPECT_NE(s.message().find(r.name), std::string::npos) << r.name << ": " << s.message();
  }
}

std::vector<std::byte> serialised(const v1::PlaneUpdate& m) {
  std::vector<std::byte> out(m.ByteSizeLong());
  m.SerializeToArray(out.data(), static_cast<int>(out.size()));
  return out;
}

v1::PlaneUpdate good_message() {
  PlaneEncoder encoder(kWithImages);
  CapturedPlane plane = linear_plane(40, 10, 5);
  plane.info.T_probe_plane = Pose{};
  const auto messages = encoder.encode(plane);
  v1::PlaneUpdate m;
  EXPECT_TRUE(m.ParseFromArray(messages->front().data(), static_cast<int>(messages->front().size())));
  return m;
}

TEST(PlaneCodec, RefusesMessagesThatViolateTheSpecification) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Refusal {
    const char* name;
    std::function<void(v1::PlaneUpdate&)> spoil;
  };
  // Tiles: 0 to 3 texture (32 and 8 texels wide), 4 lumisphere (221 nodes), 5 coverage (61 nodes).
  const std::vector<Refusal> refusals = {
      {"wire_version is 0", [](v1::PlaneUpdate& m) { m.clear_wire_version(); }},
      {"wire_version is 2", [](v1::PlaneUpdate& m) { m.set_wire_version(2); }},
      {"capture is 0", [](v1::PlaneUpdate& m) { m.set_capture(0); }},
      {"revision is 0", [](v1::PlaneUpdate& m) { m.set_revision(0); }},
      {"units", [](v1::PlaneUpdate& m) { m.clear_units(); }},
      {"size_m", [=](v1::PlaneUpdate& m) { m.set_size_m(nan); }},
      {"size_m", [](v1::PlaneUpdate& m) { m.set_size_m(-1); }},
      {"T_probe_plane", [](v1::PlaneUpdate& m) { m.mutable_t_probe_plane()->set_qw(0); }},
      {"T_probe_plane", [=](v1::PlaneUpdate& m) { m.mutable_t_probe_plane()->set_tx(nan); }},
      {"texture_to_plane", [](v1::PlaneUpdate& m) { m.mutable_texture_to_plane()->set_scale(0); }},
      {"gloss_alpha", [=](v1::PlaneUpdate& m) { m.set_gloss_alpha(static_cast<float>(nan)); }},
      {"f0", [](v1::PlaneUpdate& m) { m.set_f0(-0.1F); }},
      {"texture_edge", [](v1::PlaneUpdate& m) { m.set_texture_edge(257); }},
      {"texture_edge", [](v1::PlaneUpdate& m) { m.set_texture_edge(0xFFFFFFFF); }},
      {"lumisphere_levels", [](v1::PlaneUpdate& m) { m.set_lumisphere_levels(0); }},
      {"lumisphere_levels", [](v1::PlaneUpdate& m) { m.set_lumisphere_levels(129); }},
      {"coverage_levels", [](v1::PlaneUpdate& m) { m.set_coverage_levels(0x80000000); }},
      {"key_interval_ms", [](v1::PlaneUpdate& m) { m.set_key_interval_ms(0); }},
      {"tile_revision has not", [](v1::PlaneUpdate& m) { m.add_tile_revision(1); }},
      {"tile_revision has not", [](v1::PlaneUpdate& m) { m.clear_tile_revision(); }},
      {"above revision", [](v1::PlaneUpdate& m) { m.set_tile_revision(2, 2); }},
      {"revision is 0", [](v1::PlaneUpdate& m) { m.set_tile_revision(2, 0); }},
      {"an index", [](v1::PlaneUpdate& m) { m.mutable_tiles(0)->set_index(6); }},
      {"an index", [](v1::PlaneUpdate& m) { m.mutable_tiles(0)->set_index(0xFFFFFFFF); }},
      {"twice", [](v1::PlaneUpdate& m) { *m.mutable_tiles(5) = m.tiles(4); }},
      {"twice", [](v1::PlaneUpdate& m) { *m.add_tiles() = m.tiles(0); }},
      {"of values", [](v1::PlaneUpdate& m) { m.mutable_tiles(0)->mutable_values()->pop_back(); }},
      {"of values", [](v1::PlaneUpdate& m) { m.mutable_tiles(1)->mutable_values()->append(4, 'x'); }},
      {"of values", [](v1::PlaneUpdate& m) { m.mutable_tiles(5)->set_values("abcd"); }},
      {"of states", [](v1::PlaneUpdate& m) { m.mutable_tiles(4)->clear_states(); }},
      {"unused bits", [](v1::PlaneUpdate& m) { m.mutable_tiles(4)->mutable_states()->back() = '\x41'; }},
      {"a state", [](v1::PlaneUpdate& m) { m.mutable_tiles(4)->mutable_states()->front() = '\x03'; }},
      {"exponent", [](v1::PlaneUpdate& m) { m.mutable_tiles(4)->set_exponent(101); }},
      {"exponent", [](v1::PlaneUpdate& m) { m.mutable_tiles(4)->set_exponent(-151); }},
      {"exponent", [](v1::PlaneUpdate& m) { m.mutable_tiles(5)->set_exponent(1); }},
  };
  ASSERT_TRUE(decode_plane_update(serialised(good_message())).ok());
  for (const Refusal& r : refusals) {
    v1::PlaneUpdate m = good_message();
    r.spoil(m);
    const Status s = decode_plane_update(serialised(m)).status();
    EXPECT_EQ(s.code(), StatusCode::invalid_argument) << r.name;
    EXPECT_NE(s.message().find(r.name), std::string::npos) << r.name << ": " << s.message();
  }
  const std::vector<std::byte> zeros(kMaxPlaneMessageBytes + 1);
  EXPECT_EQ(decode_plane_update(zeros).status().code(), StatusCode::data_loss);
  EXPECT_EQ(decode_plane_update({}).status().code(), StatusCode::invalid_argument);
}

/// Damaged messages are refused, or are messages within all limits.
TEST(PlaneCodec, DamagedMessagesNeverGiveValuesOutOfRange) {
  std::mt19937 random(5);
  const std::vector<std::byte> good = serialised(good_message());
  std::size_t accepted = 0;
  for (int round = 0; round < 4000; ++round) {
    std::vector<std::byte> bytes = good;
    const int kind = round % 3;
    if (kind == 0) bytes.resize(random() % good.size());
    // The header, where most fields are, is the first 160 bytes.
    for (int k = 0; k < 1 + round % 4; ++k)
      if (!bytes.empty())
        bytes[random() % (kind == 1 ? std::min<std::size_t>(160, bytes.size()) : bytes.size())] =
            static_cast<std::byte>(random());
    const auto update = decode_plane_update(bytes);
    if (!update.ok()) continue;
    ++accepted;
    EXPECT_TRUE(plane_info_problem(update->info).ok());
    EXPECT_EQ(update->tile_revision.size(), update->layout.size());
    for (const PlaneTile& tile : update->tiles) {
      ASSERT_LT(tile.index, update->layout.size());
      ASSERT_EQ(tile.state.size(), update->layout.entries(tile.index));
      for (const Radiance& v : tile.radiance) ASSERT_TRUE(std::isfinite(v.r + v.g + v.b) && v.r >= 0);
    }
  }
  EXPECT_GT(accepted, 200U);
}

/// Version 1 is frozen: these bytes must stay decodable, to these values.
TEST(PlaneCodec, GoldenMessageOfVersion1) {
  const CapturedPlane plane = golden_plane();
  PlaneEncoder encoder(kWithImages);
  const auto messages = encoder.encode(plane);
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
