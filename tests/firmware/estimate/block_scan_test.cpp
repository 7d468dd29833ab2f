// Scans of blocks equal their definition on every Highway target, without accesses out of bounds.
#include "estimate/panorama/kernels/block_scan.hpp"

#include <algorithm>
#include <functional>

#include <gtest/gtest.h>

#include "firmware/estimate/each_target.hpp"
#include "firmware/estimate/kernel_memory.hpp"

namespace lightwell::estimate {
namespace {

struct Format {
  const char* name;
  std::size_t bytes;  ///< Of a sample.
  std::function<std::uint32_t(const std::uint8_t*)> sample, chroma;
  BlockScan (*scan)(const BlockSamples&, const SampledRows&);
};

const Format kFormats[] = {
    {"bytes", 1, [](const std::uint8_t* p) { return p[0]; }, nullptr, scan_bytes},
    {"10 bits", 2, [](const std::uint8_t* p) { return (p[0] | p[1] << 8) & 0x3FFU; }, nullptr,
     [](const BlockSamples& b, const SampledRows& r) { return scan_words(b, r, 0x3FF); }},
    {"12 bits", 2, [](const std::uint8_t* p) { return (p[0] | p[1] << 8) & 0xFFFU; }, nullptr,
     [](const BlockSamples& b, const SampledRows& r) { return scan_words(b, r, 0xFFF); }},
    {"yuyv", 2, [](const std::uint8_t* p) { return p[0]; }, [](const std::uint8_t* p) { return p[1]; }, scan_yuyv},
};

TEST(BlockScan, EqualsItsDefinition) {
  test::on_each_target([](const char* target) {
    Random random(3);
    Fenced memory(4096);
    for (const Format& format : kFormats)
      for (const int rows : {4, 8, 16})
        for (const std::size_t bytes : {8, 16, 24, 32, 48}) {
          if (format.bytes == 2 && bytes % 16 != 0) continue;
          for (const std::size_t gap : {0, 5})
            for (const SampledRows& read : {SampledRows{}, SampledRows{1, 3, 0, rows / 3},
                                            SampledRows{2, 2, 0, rows / 2}, SampledRows{1, 2, rows / 4, rows / 2}})
              for (const bool all_largest : {false, true}) {
                const std::size_t stride = bytes + gap, size = static_cast<std::size_t>(rows - 1) * stride + bytes;
                std::uint8_t* at = memory.place(size, gap == 0);
                for (std::size_t i = 0; i < size; ++i)
                  at[i] = all_largest ? 255 : static_cast<std::uint8_t>(random() % 200);
                BlockScan expected;
                for (int y = 0; y < rows; ++y)
                  for (std::size_t x = 0; x < bytes; x += format.bytes) {
                    const std::uint8_t* sample = at + static_cast<std::size_t>(y) * stride + x;
                    const std::uint32_t v = format.sample(sample);
                    expected.all += v;
                    expected.largest = std::max(expected.largest, v);
                    if (format.chroma)
                      expected.largest_chroma = std::max(expected.largest_chroma, format.chroma(sample));
                    for (int k = 0; k < read.count(rows) && !read.all(); ++k)
                      if (read.row(k) == y) expected.read += v;
                  }
                const BlockScan got = format.scan({at, stride, rows, bytes}, read);
                ASSERT_EQ(got.all, expected.all) << target << " " << format.name << " " << rows << " rows of " << bytes;
                ASSERT_EQ(got.read, expected.read)
                    << target << " " << format.name << " " << rows << " rows of " << bytes;
                ASSERT_EQ(got.largest, expected.largest) << target << " " << format.name;
                ASSERT_EQ(got.largest_chroma, expected.largest_chroma) << target << " " << format.name;
                if (format.bytes == 1) {
                  ASSERT_EQ(largest_byte({at, stride, rows, bytes}), expected.largest) << target;
                }
              }
        }
  });
}

}  // namespace
}  // namespace lightwell::estimate
