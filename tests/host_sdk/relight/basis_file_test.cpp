// Files of photographs.
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/relight_stream.hpp>

#include "host_sdk/relight/wall_scene.hpp"

namespace lightwell::test {
namespace {

class BasisFile : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = ::testing::TempDir() + "basis_file_test_" + ::testing::UnitTest::GetInstance()->current_test_info()->name();
    scene_.basis = {{{0.3, 0, 0}, LightDistance::finite, {3, 2, 1}}, {{-1, 0.5, 0}, LightDistance::finite, {1, 2, 3}}};
  }
  void TearDown() override { std::remove(path_.c_str()); }

  void write(int frames) {
    auto writer = BasisWriter::create(path_, scene_.camera.columns, scene_.camera.rows, scene_.basis.size());
    ASSERT_TRUE(writer.ok()) << writer.status().message();
    auto photographs = scene_.photographs();
    for (int f = 0; f < frames; ++f) {
      ASSERT_TRUE(writer->add(spans_of(photographs)).ok());
      for (auto& photograph : photographs)
        for (Radiance& r : photograph) r = r * 2;
    }
    ASSERT_TRUE(writer->close().ok());
  }
  [[nodiscard]] std::string bytes() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void put(const std::string& bytes) const { std::ofstream(path_, std::ios::binary | std::ios::trunc) << bytes; }

  WallScene scene_;
  std::string path_;
};

// 30 rows are two bands, the second one shorter.
TEST_F(BasisFile, ReadsWhatWasWritten) {
  write(3);
  auto reader = BasisReader::open(path_);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ(reader->info().frames, 3U);
  EXPECT_EQ(reader->info().lights, 2U);
  const auto photographs = scene_.photographs();
  std::vector<Radiance> out(scene_.camera.pixels());
  for (const std::size_t frame : {2U, 0U, 1U})
    for (std::size_t light = 0; light < 2; ++light) {
      ASSERT_TRUE(reader->read(frame, light, out).ok());
      float largest = 0;
      for (const Radiance& r : photographs[light]) largest = std::max({largest, r.r, r.g, r.b});
      const auto scale = static_cast<float>(1U << frame);
      // Half a step of 255 of the square root: 1 / 255 of sqrt(value x largest).
      for (std::size_t p = 0; p < out.size(); ++p)
        for (int c = 0; c < 3; ++c)
          EXPECT_NEAR(out[p][c], scale * photographs[light][p][c],
                      scale * (std::sqrt(photographs[light][p][c] * largest) / 255 + largest * 1e-5F));
    }
}

TEST_F(BasisFile, RelightsAsInMemory) {
  write(2);
  auto reader = BasisReader::open(path_);
  ASSERT_TRUE(reader.ok());
  const std::vector<RgbFactor> slide = {{1, 0, 0.5F}, {0.2F, 1, 0}, {0, 0.3F, 1}, {1, 1, 1}};
  AlphaMaps alpha;
  ASSERT_TRUE(alpha
                  .compute(scene_.subject(), scene_.basis, std::array{pattern_at({0.3, 0, 0}, 2, 2, slide)},
                           std::array{RgbFactor{0.1F, 0.2F, 0.3F}, RgbFactor{0.5F, 0, 1}})
                  .ok());
  std::vector<std::vector<Radiance>> photographs(2, std::vector<Radiance>(scene_.camera.pixels()));
  for (std::size_t light = 0; light < 2; ++light) ASSERT_TRUE(reader->read(1, light, photographs[light]).ok());
  std::vector<Radiance> streamed(scene_.camera.pixels()), in_memory = streamed;
  ASSERT_TRUE(reader->relight(alpha, 1, streamed).ok());
  ASSERT_TRUE(relight_direct(alpha, spans_of(photographs), in_memory).ok());
  for (std::size_t p = 0; p < streamed.size(); ++p)
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(streamed[p][c], in_memory[p][c], 1e-5F * in_memory[p][c] + 1e-7F);
  // Lights without alpha and weight are not read.
  ASSERT_TRUE(alpha.compute(scene_.subject(), scene_.basis, {}, std::array{RgbFactor{}, RgbFactor{1, 1, 1}}).ok());
  ASSERT_TRUE(reader->relight(alpha, 0, streamed).ok());
  EXPECT_NEAR(streamed[7].g, scene_.photographs()[1][7].g, 0.01F);
}

TEST_F(BasisFile, DamagedPhotographsAndBlackOnes) {
  auto writer = BasisWriter::create(path_, 40, 30, 2);
  ASSERT_TRUE(writer.ok());
  std::vector<std::vector<Radiance>> photographs(2, std::vector<Radiance>(scene_.camera.pixels()));
  photographs[0][0] = {std::numeric_limits<float>::quiet_NaN(), -1, std::numeric_limits<float>::infinity()};
  photographs[0][1] = {4, 1, 0};
  ASSERT_TRUE(writer->add(spans_of(photographs)).ok());
  EXPECT_FALSE(writer->add({}).ok());
  ASSERT_TRUE(writer->close().ok());
  auto reader = BasisReader::open(path_);
  ASSERT_TRUE(reader.ok());
  std::vector<Radiance> out(scene_.camera.pixels());
  ASSERT_TRUE(reader->read(0, 0, out).ok());
  EXPECT_EQ(out[0], Radiance{});
  EXPECT_FLOAT_EQ(out[1].r, 4);
  ASSERT_TRUE(reader->read(0, 1, out).ok());
  EXPECT_EQ(out[1], Radiance{});
}

TEST_F(BasisFile, DamagedFiles) {
  write(2);
  const std::string good = bytes();
  EXPECT_EQ(BasisReader::open(path_ + "_absent").status().code(), StatusCode::not_found);
  for (const std::size_t size : {std::size_t{0}, std::size_t{7}, std::size_t{19}, good.size() - 1}) {
    put(good.substr(0, size));
    EXPECT_EQ(BasisReader::open(path_).status().code(), StatusCode::data_loss) << size;
  }
  for (const std::size_t at : {8U, 12U, 16U}) {
    std::string bad = good;
    bad.replace(at, 4, "\xff\xff\xff\xff");
    put(bad);
    EXPECT_EQ(BasisReader::open(path_).status().code(), StatusCode::data_loss) << at;
  }
  std::string version = good;
  version[4] = 2;
  put(version);
  EXPECT_EQ(BasisReader::open(path_).status().code(), StatusCode::invalid_argument);
  // The scale of a photograph is no number.
  std::string scale = good;
  scale.replace(20, 4, "\xff\xff\xff\x7f");
  put(scale);
  auto reader = BasisReader::open(path_);
  ASSERT_TRUE(reader.ok());
  std::vector<Radiance> out(scene_.camera.pixels());
  EXPECT_EQ(reader->read(0, 0, out).code(), StatusCode::data_loss);
  EXPECT_TRUE(reader->read(1, 0, out).ok());
  // The file is cut while it is open.
  put(good.substr(0, good.size() / 2 + 100));
  EXPECT_EQ(reader->read(1, 1, out).code(), StatusCode::data_loss);
  EXPECT_EQ(reader->read(2, 0, out).code(), StatusCode::not_found);
  EXPECT_EQ(reader->read(0, 2, out).code(), StatusCode::not_found);
}

TEST_F(BasisFile, RefusesOtherSizes) {
  EXPECT_FALSE(BasisWriter::create(path_, 0, 1, 1).ok());
  EXPECT_FALSE(BasisWriter::create(path_, 1, 1, 257).ok());
  EXPECT_EQ(BasisWriter::create("/nonexistent/file", 1, 1, 1).status().code(), StatusCode::not_found);
  write(1);
  auto reader = BasisReader::open(path_);
  ASSERT_TRUE(reader.ok());
  std::vector<Radiance> out(scene_.camera.pixels());
  EXPECT_EQ(reader->relight(AlphaMaps(), 0, out).code(), StatusCode::invalid_argument);
  EXPECT_FALSE(reader->read(0, 0, std::span(out).first(2)).ok());
}

}  // namespace
}  // namespace lightwell::test
