#include <ImathBox.h>
#include <cmath>
#include <limits>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "imaging/image_file.hpp"
#include "support/read_file.hpp"
#include "support/temp_dir.hpp"

namespace lightwell {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth = 37, kHeight = 21;

struct Planes {
  std::vector<float> red, green, blue;
};

Planes planes() {
  Planes p;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    p.red.push_back(static_cast<float>(i));
    p.green.push_back(-0.25F * static_cast<float>(i));
    p.blue.push_back(static_cast<float>(i % 7) * 0.125F);
  }
  return p;
}

Imf::Header header_of(std::initializer_list<const char*> channels, Imf::PixelType type = Imf::FLOAT) {
  Imf::Header header(kWidth, kHeight);
  for (const char* name : channels) header.channels().insert(name, Imf::Channel(type));
  return header;
}

Imf::FrameBuffer buffer_of(Planes& p, std::initializer_list<const char*> channels, const Imath::Box2i& window) {
  Imf::FrameBuffer buffer;
  std::vector<float>* all[] = {&p.red, &p.green, &p.blue, &p.red};
  std::size_t i = 0;
  for (const char* name : channels)
    buffer.insert(name, Imf::Slice::Make(Imf::FLOAT, all[i++]->data(), window, 4, 4 * kWidth));
  return buffer;
}

void write(const std::string& path, const Imf::Header& header, Planes& p, std::initializer_list<const char*> channels) {
  Imf::OutputFile file(path.c_str(), header);
  file.setFrameBuffer(buffer_of(p, channels, header.dataWindow()));
  file.writePixels(kHeight);
}

float value(const Image& image, int x, int y, std::size_t channel) {
  float v = 0;
  std::memcpy(
      &v,
      image.data.data() + image.stride() * static_cast<std::size_t>(y) + 12 * static_cast<std::size_t>(x) + 4 * channel,
      4);
  return v;
}

void expect_planes(const Result<Image>& image, const Planes& p) {
  ASSERT_TRUE(image.ok()) << image.status().message();
  ASSERT_EQ(image->width, kWidth);
  ASSERT_EQ(image->height, kHeight);
  ASSERT_EQ(image->format, PixelFormat::rgb_f32);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto i = static_cast<std::size_t>(y * kWidth + x);
      ASSERT_EQ(value(*image, x, y, 0), p.red[i]) << x << ' ' << y;
      ASSERT_EQ(value(*image, x, y, 1), p.green[i]) << x << ' ' << y;
      ASSERT_EQ(value(*image, x, y, 2), p.blue[i]) << x << ' ' << y;
    }
}

class ImageExr : public ::testing::Test {
 protected:
  test::TempDir scratch;
  std::string path = scratch.path("x.exr");
  Planes p = planes();
};

TEST_F(ImageExr, FloatsInAnyCompressionAndLineOrderComeBackExactly) {
  for (const auto compression : {Imf::NO_COMPRESSION, Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION})
    for (const auto order : {Imf::INCREASING_Y, Imf::DECREASING_Y}) {
      Imf::Header header = header_of({"R", "G", "B"});
      header.compression() = compression;
      header.lineOrder() = order;
      write(path, header, p, {"R", "G", "B"});
      expect_planes(read_image(path), p);
    }
}

TEST_F(ImageExr, AlphaIsIgnoredAndAWindowMayBeginAnywhere) {
  Imf::Header header = header_of({"R", "G", "B", "A"});
  header.dataWindow() = header.displayWindow() = Imath::Box2i({-5, 100}, {-5 + kWidth - 1, 100 + kHeight - 1});
  write(path, header, p, {"R", "G", "B", "A"});
  expect_planes(read_image(path), p);
}

TEST_F(ImageExr, HalvesAndIntegersBecomeFloats) {
  for (const auto type : {Imf::HALF, Imf::UINT}) {
    // Written from a buffer of the file's type, because OpenEXR converts only when reading.
    std::vector<std::uint32_t> words(kWidth * kHeight, type == Imf::HALF ? 0x3E00U : 6U);
    Imf::FrameBuffer buffer;
    for (const char* name : {"R", "G", "B"})
      buffer.insert(name, Imf::Slice(type, reinterpret_cast<char*>(words.data()), 4, 4 * kWidth));
    {
      Imf::OutputFile file(path.c_str(), header_of({"R", "G", "B"}, type));
      file.setFrameBuffer(buffer);
      file.writePixels(kHeight);
    }
    const auto image = read_image(path);
    ASSERT_TRUE(image.ok()) << image.status().message();
    EXPECT_EQ(value(*image, 3, 4, 1), type == Imf::HALF ? 1.5F : 6.0F);
  }
}

TEST_F(ImageExr, TilesAndTheFirstOfSeveralPartsAreRead) {
  Imf::Header tiled = header_of({"R", "G", "B"});
  tiled.setTileDescription(Imf::TileDescription(16, 8, Imf::MIPMAP_LEVELS));
  {
    Imf::TiledOutputFile file(path.c_str(), tiled);
    file.setFrameBuffer(buffer_of(p, {"R", "G", "B"}, tiled.dataWindow()));
    for (int level = 0; level < file.numLevels(); ++level)
      file.writeTiles(0, file.numXTiles(level) - 1, 0, file.numYTiles(level) - 1, level);
  }
  expect_planes(read_image(path), p);

  Imf::Header parts[] = {header_of({"R", "G", "B"}), header_of({"R", "G", "B"})};
  Planes other = planes();
  for (float& v : other.red) v = 9;
  {
    const char* const names[] = {"left", "right"};
    for (int i = 0; i < 2; ++i) {
      parts[i].setName(names[i]);
      parts[i].setType(Imf::SCANLINEIMAGE);
    }
    Imf::MultiPartOutputFile file(path.c_str(), parts, 2);
    for (int i = 0; i < 2; ++i) {
      Imf::OutputPart part(file, i);
      part.setFrameBuffer(buffer_of(i == 0 ? p : other, {"R", "G", "B"}, parts[i].dataWindow()));
      part.writePixels(kHeight);
    }
  }
  expect_planes(read_image(path), p);
}

TEST_F(ImageExr, GreyIsExpanded) {
  write(path, header_of({"Y"}), p, {"Y"});
  p.green = p.blue = p.red;
  expect_planes(read_image(path), p);
}

TEST_F(ImageExr, NegativeInfiniteAndNanStay) {
  p.red[0] = std::numeric_limits<float>::quiet_NaN();
  p.red[1] = std::numeric_limits<float>::infinity();
  p.red[2] = -3;
  write(path, header_of({"R", "G", "B"}), p, {"R", "G", "B"});
  const auto image = read_image(path);
  ASSERT_TRUE(image.ok()) << image.status().message();
  EXPECT_TRUE(std::isnan(value(*image, 0, 0, 0)));
  EXPECT_EQ(value(*image, 1, 0, 0), std::numeric_limits<float>::infinity());
  EXPECT_EQ(value(*image, 2, 0, 0), -3);
}

TEST_F(ImageExr, TruncationAtAnyLengthIsDataLossWithTheLibrarysMessage) {
  write(path, header_of({"R", "G", "B"}), p, {"R", "G", "B"});
  const auto whole = test::read_bytes(path);
  for (std::size_t n = 4; n < whole.size(); n += n < 500 || n + 40 > whole.size() ? 1 : 31) {
    const auto image = read_image(scratch.write("cut.exr", std::span(whole).first(n)));
    ASSERT_FALSE(image.ok()) << n << " of " << whole.size();
    ASSERT_EQ(image.status().code(), StatusCode::data_loss) << n << ' ' << image.status().message();
    ASSERT_THAT(image.status().message(), HasSubstr("OpenEXR"));
  }
}

TEST_F(ImageExr, AnyDamagedByteEndsInAStatus) {
  write(path, header_of({"R", "G", "B"}), p, {"R", "G", "B"});
  const auto whole = test::read_bytes(path);
  for (std::size_t i = 4; i < whole.size(); i += i < 500 ? 1 : 41) {
    auto damaged = whole;
    damaged[i] ^= std::byte{0xFF};
    // OpenEXR has checksums only for compressed pixels: check only that reading does not crash.
    (void)read_image(scratch.write("damaged.exr", damaged));
  }
}

TEST_F(ImageExr, MissingChannelAndOddWindowsAreRefusedByName) {
  write(path, header_of({"R", "G"}), p, {"R", "G"});
  EXPECT_THAT(read_image(path).status().message(), HasSubstr("no channel B"));
  write(path, header_of({"Z"}), p, {"Z"});
  EXPECT_THAT(read_image(path).status().message(), HasSubstr("no channel R"));

  for (const int grown : {-1, 1}) {
    Imf::Header header = header_of({"R", "G", "B"});
    header.displayWindow().max.x += grown;
    write(path, header, p, {"R", "G", "B"});
    const auto image = read_image(path);
    EXPECT_EQ(image.status().code(), StatusCode::invalid_argument);
    EXPECT_THAT(image.status().message(), HasSubstr("display window"));
  }
}

TEST_F(ImageExr, HugeHeaderIsRefusedBeforeMemoryIsTaken) {
  write(path, header_of({"R", "G", "B"}), p, {"R", "G", "B"});
  auto bytes = test::read_bytes(path);
  // Set both windows to 2^30 in each direction.
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (const std::string_view name : {"dataWindow", "displayWindow"}) {
    const std::size_t at = text.find(name) + name.size() + std::string_view("\0box2i\0....", 11).size();
    const std::int32_t huge[] = {0, 0, 1 << 30, 1 << 30};
    std::memcpy(bytes.data() + at, huge, sizeof huge);
  }
  const auto image = read_image(scratch.write("huge.exr", bytes));
  EXPECT_EQ(image.status().code(), StatusCode::invalid_argument);
  EXPECT_THAT(image.status().message(), HasSubstr("64 megapixels"));
}

}  // namespace
}  // namespace lightwell
