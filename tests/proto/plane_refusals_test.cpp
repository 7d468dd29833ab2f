// Planes that are not encoded, and messages of planes that are not decoded: out of range, hostile, damaged.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/plane_codec.hpp>

#include "lightwell/v1/captured_plane.pb.h"
#include "support/captured_planes.hpp"

namespace lightwell {
namespace {

using test::linear_plane;

constexpr PlaneEncoderOptions kWithImages{.images = ImageRecipients::all_clients};

TEST(PlaneRefusals, RefusesPlanesOutOfRange) {
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
    const Status s = encoder.encode(plane, {}).status();
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
  const auto messages = encoder.encode(plane, {});
  v1::PlaneUpdate m;
  EXPECT_TRUE(m.ParseFromArray(messages->front().data(), static_cast<int>(messages->front().size())));
  return m;
}

TEST(PlaneRefusals, RefusesMessagesThatViolateTheSpecification) {
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
TEST(PlaneRefusals, DamagedMessagesNeverGiveValuesOutOfRange) {
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

}  // namespace
}  // namespace lightwell
