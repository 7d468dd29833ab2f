// Conversion of YCbCr equals rgb8_of_ycbcr601() on every Highway target.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>

#include <gtest/gtest.h>

#include <lightwell/pixel.hpp>

#include "estimate/panorama/kernels/lane_sums.hpp"
#include "firmware/estimate/each_target.hpp"
#include "firmware/estimate/kernel_memory.hpp"

namespace lightwell::estimate {
namespace {

struct Planes {
  Guarded<std::uint8_t> r, g, b;
  explicit Planes(std::size_t n) : r(n), g(n), b(n) {}
  PlaneRow row() { return {r.data(), g.data(), b.data()}; }
  [[nodiscard]] bool guards_hold() const { return r.guards_hold() && g.guards_hold() && b.guards_hold(); }
};

TEST(YcbcrPlanes, ConvertEveryCombinationOfBytes) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    std::array<std::uint8_t, 256> luma, chroma;
    std::array<std::uint8_t, 512> yuyv;
    for (std::size_t i = 0; i < 256; ++i) luma[i] = static_cast<std::uint8_t>(i);
    // The lower row is reversed: two rows share only their chroma.
    std::array<std::uint8_t, 256> falling;
    for (std::size_t i = 0; i < 256; ++i) falling[i] = static_cast<std::uint8_t>(255 - i);
    Planes of_nv12(256), below(256), of_yuyv(256);
    std::uint64_t wrong = 0;
    for (int cb = 0; cb < 256; ++cb) {
      for (int cr = 0; cr < 256; ++cr) {
        for (std::size_t i = 0; i < 256; ++i) {
          chroma[i] = static_cast<std::uint8_t>(i % 2 == 0 ? cb : cr);
          yuyv[2 * i] = luma[i];
          yuyv[2 * i + 1] = chroma[i];
        }
        planes_of_nv12(luma.data(), falling.data(), chroma.data(), 256, of_nv12.row(), below.row());
        planes_of_yuyv(yuyv.data(), 256, of_yuyv.row());
        for (std::size_t y = 0; y < 256; ++y) {
          const auto rgb = rgb8_of_ycbcr601(static_cast<int>(y), cb, cr);
          wrong += of_nv12.r[y] != rgb[0] || of_nv12.g[y] != rgb[1] || of_nv12.b[y] != rgb[2];
          wrong += below.r[255 - y] != rgb[0] || below.g[255 - y] != rgb[1] || below.b[255 - y] != rgb[2];
          wrong += of_yuyv.r[y] != rgb[0] || of_yuyv.g[y] != rgb[1] || of_yuyv.b[y] != rgb[2];
        }
        ASSERT_EQ(wrong, 0U) << "Cb " << cb << ", Cr " << cr;
      }
    }
    EXPECT_TRUE(of_nv12.guards_hold() && below.guards_hold() && of_yuyv.guards_hold());
  });
}

TEST(YcbcrPlanes, ReadNothingOutsideTheRow) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    Random random(3);
    Fenced first(2048), second(2048), third(2048);
    for (std::size_t pixels = kMinLanes; pixels <= 400; pixels += 2) {
      for (const bool at_the_end : {false, true}) {
        std::uint8_t* yuyv = first.place(2 * pixels, at_the_end);
        fill(yuyv, 2 * pixels, 2, random);
        Planes got(pixels);
        planes_of_yuyv(yuyv, pixels, got.row());
        ASSERT_TRUE(got.guards_hold()) << pixels;
        for (std::size_t x = 0; x < pixels; ++x) {
          const std::size_t pair = x / 2 * 4;
          const auto rgb = rgb8_of_ycbcr601(yuyv[2 * x], yuyv[pair + 1], yuyv[pair + 3]);
          ASSERT_TRUE(got.r[x] == rgb[0] && got.g[x] == rgb[1] && got.b[x] == rgb[2]) << x << " of " << pixels;
        }
        std::uint8_t* luma = first.place(pixels, at_the_end);
        std::uint8_t* chroma = second.place(pixels, at_the_end);
        std::uint8_t* other = third.place(pixels, at_the_end);
        fill(luma, pixels, 2, random);
        fill(other, pixels, 2, random);
        fill(chroma, pixels, 2, random);
        Planes below(pixels), single(pixels);
        planes_of_nv12(luma, other, chroma, pixels, got.row(), below.row());
        planes_of_nv12(luma, luma, chroma, pixels, single.row(), single.row());
        ASSERT_TRUE(got.guards_hold() && below.guards_hold() && single.guards_hold()) << pixels;
        for (std::size_t x = 0; x < pixels; ++x) {
          const auto expect = [&](const Planes& planes, const std::uint8_t* row) {
            const auto rgb = rgb8_of_ycbcr601(row[x], chroma[x / 2 * 2], chroma[x / 2 * 2 + 1]);
            return planes.r[x] == rgb[0] && planes.g[x] == rgb[1] && planes.b[x] == rgb[2];
          };
          ASSERT_TRUE(expect(got, luma) && expect(below, other) && expect(single, luma)) << x << " of " << pixels;
        }
      }
    }
  });
}

TEST(ChromaChanges, EqualTheirDefinition) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    Random random(4);
    Fenced first(2048), second(2048), third(2048);
    constexpr std::size_t kPixels = 320;
    for (const unsigned range : {1U, 20U, 256U}) {
      std::uint8_t *luma = first.place(kPixels, true), *chroma = second.place(kPixels, true),
                   *yuyv = third.place(2 * kPixels, true);
      for (std::size_t i = 0; i < kPixels; ++i) {
        // The last pixels may be left out: they are equal.
        const bool equal = i >= kPixels - 80;
        luma[i] = equal ? luma[i - 2] : static_cast<std::uint8_t>(random() % range);
        chroma[i] = equal ? chroma[i - 2] : static_cast<std::uint8_t>(random() % range);
        yuyv[2 * i] = luma[i];
        yuyv[2 * i + 1] = chroma[i];
      }
      std::uint64_t expected = 0;
      for (std::size_t i = 0; i + 2 < kPixels; ++i) {
        const int c = std::abs(chroma[i + 2] - chroma[i]), l = std::abs(luma[i + 2] - luma[i]);
        if (c > kMinChromaChange) expected += static_cast<std::uint64_t>(c * std::min(255, c + l / 2));
      }
      EXPECT_EQ(chroma_changes_of_nv12(luma, chroma, kPixels), expected) << range;
      EXPECT_EQ(chroma_changes_of_yuyv(yuyv, kPixels), expected) << range;
    }
  });
}

}  // namespace
}  // namespace lightwell::estimate
