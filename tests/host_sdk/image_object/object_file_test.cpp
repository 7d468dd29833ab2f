// The file of an image-based object: each view by itself, and damaged input.
#include <cmath>
#include <cstring>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/bytes.hpp>
#include <lightwell/image_object.hpp>

#include "host_sdk/image_object/matte_ball.hpp"
#include "image_object/block_coder.hpp"
#include "image_object/view_codec.hpp"

namespace lightwell::test {
namespace {

using testing::HasSubstr;

constexpr ObjectEncoderOptions kCoarse{0.06F, 0.2F, 0.03F};

Ball turned_ball() {
  Ball ball(7, 0.3F);
  ball.rig.turns_rad = {0, 0.07F, 0.14F};
  return ball;
}

TEST(ImageObject, KeepsItsRig) {
  Ball ball = turned_ball();
  ball.rig.reference_irradiance = 12.5F;
  const auto object = ImageObject::from_bytes(file_of(ball, kCoarse));
  ASSERT_TRUE(object.ok());
  EXPECT_EQ(object->rig().columns, Ball::kSide);
  EXPECT_EQ(object->rig().rows, Ball::kSide);
  EXPECT_EQ(object->rig().light_positions, ball.rig.light_positions);
  EXPECT_EQ(object->rig().turns_rad, ball.rig.turns_rad);
  EXPECT_EQ(object->rig().reference_irradiance, 12.5F);
  EXPECT_EQ(object->rig().camera_distance_m, 5);
  EXPECT_EQ(object->rig().half_width_m, 1);
  EXPECT_EQ(object->view(1)->turn_rad(), 0.07F);
}

TEST(ImageObject, DecodesEachViewWithoutTheOthers) {
  std::string file = file_of(turned_ball(), kCoarse);
  const auto intact = ImageObject::from_bytes(file);
  // The last view lies at the end of the file.
  file.back() = static_cast<char>(file.back() ^ 1);
  const auto object = ImageObject::from_bytes(file);
  ASSERT_TRUE(object.ok());
  EXPECT_TRUE(object->view(0).ok());
  EXPECT_TRUE(object->view(1).ok());
  const Status damaged = object->view(2).status();
  EXPECT_EQ(damaged.code(), StatusCode::data_loss);
  EXPECT_THAT(damaged.message(), HasSubstr("view 2"));
  EXPECT_EQ(object->view(3).status().code(), StatusCode::not_found);
}

TEST(ImageObject, KeepsCoverageWithinASixteenth) {
  Ball ball(3);
  for (std::size_t p = 0; p < ball.coverage.size(); ++p)
    if (ball.coverage[p] != 0 && p % 3 == 0) ball.coverage[p] = static_cast<std::uint8_t>(1 + p % 254);
  const ObjectView view = view_of(ball, kCoarse);
  for (std::size_t p = 0; p < ball.coverage.size(); ++p) {
    EXPECT_NEAR(view.coverage()[p], ball.coverage[p], 16);
    EXPECT_EQ(view.coverage()[p] == 0, ball.coverage[p] == 0);
    EXPECT_EQ(view.coverage()[p] == 255, ball.coverage[p] == 255);
  }
}

TEST(ImageObject, GetsSmallerWithLargerSteps) {
  const Ball ball(21, 0.4F);
  EXPECT_LT(2 * encoded(ball, {0.12F, 0.4F, 0.03F}).size(), encoded(ball, {0.01F, 0.04F, 0.01F}).size());
}

TEST(ImageObject, FindsTheNearestView) {
  const auto object = ImageObject::from_bytes(file_of(turned_ball(), kCoarse));
  ASSERT_TRUE(object.ok());
  EXPECT_EQ(object->nearest_view({0, 1, 5}), 0U);
  // With the object turned by +0.14, the camera at +Z sees it from -0.14.
  EXPECT_EQ(object->nearest_view({5 * std::sin(-0.14), 0, 5 * std::cos(0.14)}), 2U);
  EXPECT_EQ(object->nearest_view({5 * std::sin(0.14), 0, 5 * std::cos(0.14)}), 0U);
  EXPECT_EQ(object->nearest_view({0, 3, 0}), std::nullopt);
}

TEST(ImageObject, RefusesOtherFilesAndVersions) {
  EXPECT_EQ(ImageObject::from_bytes("").status().code(), StatusCode::invalid_argument);
  EXPECT_THAT(ImageObject::from_bytes(std::string(100, 'x')).status().message(), HasSubstr("LWIO"));
  std::string file = file_of(turned_ball(), kCoarse);
  file[4] = 2;
  EXPECT_THAT(ImageObject::from_bytes(file).status().message(), HasSubstr("format version 2"));
}

TEST(ImageObject, RefusesEveryTruncation) {
  const std::string file = file_of(turned_ball(), kCoarse);
  for (std::size_t length = 0; length < file.size(); length += length < 300 ? 1 : 97)
    EXPECT_FALSE(ImageObject::from_bytes(file.substr(0, length)).ok()) << length;
  EXPECT_FALSE(ImageObject::from_bytes(file + "x").ok());
}

TEST(ImageObject, RefusesEveryChangedByteOfItsHeader) {
  const std::string file = file_of(turned_ball(), kCoarse);
  for (std::size_t at = 0; at < 36 + 7 * 12 + 3 * 12 + 4; ++at) {
    std::string changed = file;
    changed[at] = static_cast<char>(changed[at] ^ 4);
    EXPECT_FALSE(ImageObject::from_bytes(changed).ok()) << at;
  }
}

TEST(ImageObject, RefusesSizesBeyondItsLimitsBeforeItReadsTables) {
  std::string file = file_of(turned_ball(), kCoarse);
  for (const std::size_t at : {std::size_t{16}, std::size_t{20}}) {
    std::string changed = file;
    put_le(changed.data() + at, std::uint32_t{0xFFFFFFFF});
    EXPECT_EQ(ImageObject::from_bytes(changed).status().code(), StatusCode::data_loss);
  }
}

/// Bytes that pass every checksum: an attacker's, not an accident's.
TEST(View, DamagedAnywhereIsRefusedOrRelitWithFiniteValues) {
  Ball ball(7, 0.3F);
  const std::string view = encoded(ball, kCoarse);
  std::mt19937 random(3);
  int decoded_views = 0;
  const auto probe = [&](const std::string& bytes) {
    const auto decoded = image_object::read_view(ball.rig, 0, std::as_bytes(std::span(bytes)));
    if (!decoded.ok()) {
      EXPECT_EQ(decoded.status().code(), StatusCode::data_loss);
      return;
    }
    ++decoded_views;
    for (const Radiance& p : relit(ObjectView(*decoded), {{{0.3F, 0.2F, 1}, {1e9F, 1, 1}}, {{1, 0, 1}, {1, 1, 1e9F}}}))
      ASSERT_TRUE(std::isfinite(p.r + p.g + p.b) && p.r >= 0 && p.g >= 0 && p.b >= 0);
  };
  for (std::size_t at = 0; at < view.size(); ++at)
    for (const int flip : {1, 0x80, 0xFF}) {
      if (at > 400 && random() % 4 != 0) continue;
      std::string changed = view;
      changed[at] = static_cast<char>(changed[at] ^ flip);
      probe(changed);
    }
  for (int k = 0; k < 300; ++k) {
    std::string changed = view;
    for (int n = 0; n < 8; ++n) changed[random() % changed.size()] = static_cast<char>(random());
    probe(changed);
  }
  for (std::size_t length = 0; length < view.size(); length += 11) probe(view.substr(0, length));
  // Some damage is not visible without the checksum.
  EXPECT_GT(decoded_views, 0);
}

TEST(View, WithMoreCoefficientsThanBitsIsRefusedBeforeItAllocates) {
  const Ball ball(7);
  std::string view = encoded(ball, kCoarse);
  put_le(view.data() + 4 + 4 + 2, std::uint32_t{0x7FFFFFFF});
  const auto decoded = image_object::read_view(ball.rig, 0, std::as_bytes(std::span(view)));
  EXPECT_THAT(decoded.status().message(), HasSubstr("fewer bits than coefficients"));
}

TEST(View, OfAnotherRigIsRefusedByTheFile) {
  const Ball ball(7);
  const std::vector<std::string> views = {encoded(ball, kCoarse).substr(0, 50)};
  EXPECT_THAT(make_image_object(ball.rig, views).status().message(), HasSubstr("view 0: the view is damaged"));
  EXPECT_THAT(make_image_object(ball.rig, {}).status().message(), HasSubstr("0 views for 1 turns"));
}

TEST(BlockCoder, ReturnsTheLevelsThatItWasGiven) {
  std::mt19937 random(5);
  std::vector<image_object::BlockLevels> blocks(300);
  for (auto& block : blocks) {
    const auto count = random() % 65;
    for (std::size_t z = 0; z < count; ++z) block.level[z] = random() % 3 == 0 ? static_cast<int>(random() % 9) - 4 : 0;
    if (count > 0 && random() % 8 == 0) block.level[count - 1] = static_cast<int>(random() % 2000000) - 1000000;
    for (std::size_t z = 0; z < 64; ++z)
      if (block.level[z] != 0) block.count = static_cast<int>(z) + 1;
  }
  blocks[7].level[63] = image_object::kMaxLevel;
  blocks[8].level[63] = -image_object::kMaxLevel;
  blocks[7].count = blocks[8].count = 64;
  image_object::RangeEncoder encoder;
  image_object::BitWriter writer{encoder};
  image_object::BlockModels models;
  image_object::BlockModels::Context context;
  for (auto& block : blocks) models.code(writer, block, context, static_cast<int>(block.count) / 3);
  const std::string bytes = encoder.finish();
  image_object::RangeDecoder decoder(std::as_bytes(std::span(bytes)));
  image_object::BitReader reader{decoder};
  image_object::BlockModels again;
  context = {};
  for (const auto& block : blocks) {
    image_object::BlockLevels read;
    again.code(reader, read, context, block.count / 3);
    ASSERT_EQ(read.count, block.count);
    for (int z = 0; z < block.count; ++z)
      ASSERT_EQ(read.level[static_cast<std::size_t>(z)], block.level[static_cast<std::size_t>(z)]);
  }
  EXPECT_FALSE(decoder.overrun());
}

}  // namespace
}  // namespace lightwell::test
