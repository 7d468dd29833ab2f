// The vector kernels do the sums that their headers promise, on every vector unit, and look at nothing else.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/pixel.hpp>

#include "firmware/estimate/each_target.hpp"
#include "estimate/common/kernels/weighted_rows.hpp"
#include "estimate/panorama/kernels/lane_sums.hpp"

namespace lightwell::estimate {
namespace {

using Random = std::mt19937;

unsigned below(Random& random, std::size_t n) { return static_cast<unsigned>(random() % n); }

/// Memory between two pages that must not be touched: who reads a byte too far ends the test.
class Fenced {
 public:
  explicit Fenced(std::size_t room) : page_(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))) {
    room_ = (room + page_ - 1) / page_ * page_;
    all_ = static_cast<std::uint8_t*>(
        mmap(nullptr, room_ + 2 * page_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    if (all_ == MAP_FAILED || mprotect(all_ + page_, room_, PROT_READ | PROT_WRITE) != 0) std::abort();
  }
  Fenced(const Fenced&) = delete;
  Fenced& operator=(const Fenced&) = delete;
  ~Fenced() { munmap(all_, room_ + 2 * page_); }

  /// `bytes` that begin right after the first fence, or end right before the second.
  std::uint8_t* place(std::size_t bytes, bool at_the_end) {
    if (bytes > room_) std::abort();
    return all_ + page_ + (at_the_end ? room_ - bytes : 0);
  }

 private:
  std::size_t page_, room_;
  std::uint8_t* all_;
};

/// An array with `count` entries to write, and guards on either side that must stay.
template <class T>
class Guarded {
 public:
  explicit Guarded(std::size_t count) : values_(count + 2 * kGuard, mark()) {}
  T* data() { return values_.data() + kGuard; }
  T operator[](std::size_t i) const { return values_[i + kGuard]; }
  [[nodiscard]] bool guards_hold() const {
    const auto is_mark = [](T v) { return v == mark(); };
    return std::all_of(values_.begin(), values_.begin() + kGuard, is_mark) &&
           std::all_of(values_.end() - kGuard, values_.end(), is_mark);
  }

 private:
  /// Wider than any vector.
  static constexpr std::ptrdiff_t kGuard = 256;
  static T mark() { return static_cast<T>(0xA5A5A5A5U); }
  std::vector<T> values_;
};

struct Sums {
  Guarded<std::uint32_t> sum, early;
  Guarded<std::uint16_t> peak, clipped;
  explicit Sums(std::size_t n) : sum(n), early(n), peak(n), clipped(n) {}
  LaneSums out() { return {sum.data(), early.data(), peak.data(), clipped.data()}; }
  [[nodiscard]] bool guards_hold() const {
    return sum.guards_hold() && early.guards_hold() && peak.guards_hold() && clipped.guards_hold();
  }
};

/// One lane by the words of lane_sums.hpp.
struct Lane {
  std::uint32_t sum = 0, early = 0, peak = 0, clipped = 0;
  void add(unsigned code, unsigned linear, unsigned rows_left, bool seen, unsigned clipped_from) {
    sum += linear;
    early += rows_left * linear;
    if (!seen) return;
    peak = std::max(peak, code);
    clipped += code >= clipped_from ? 1 : 0;
  }
};

enum class Weights { none, random, with_holes, full, nothing };

struct Case {
  std::size_t lanes;
  int rows;
  std::size_t stride, weight_stride;
  Weights weights;
  unsigned clipped_from;
  bool at_the_end;

  friend std::ostream& operator<<(std::ostream& out, const Case& c) {
    return out << c.lanes << " lanes, " << c.rows << " rows, stride " << c.stride << ", weights "
               << static_cast<int>(c.weights) << " stride " << c.weight_stride << ", clipped from " << c.clipped_from;
  }
};

/// Bytes of weights at the end of their memory.
const std::uint8_t* put_weights(const Case& c, Fenced& memory, Random& random) {
  if (c.weights == Weights::none) return nullptr;
  const std::size_t bytes = static_cast<std::size_t>(c.rows - 1) * c.weight_stride + c.lanes;
  std::uint8_t* at = memory.place(bytes, c.at_the_end);
  for (std::size_t i = 0; i < bytes; ++i) {
    const auto any = static_cast<std::uint8_t>(random());
    at[i] = c.weights == Weights::full                               ? 255
            : c.weights == Weights::nothing                          ? 0
            : c.weights == Weights::with_holes && random() % 3 == 0 ? 0
                                                                     : any;
  }
  return at;
}

/// Every length around the widths of all vectors, from the fewest lanes on.
constexpr std::size_t kLanes[] = {64, 65, 66, 79, 80, 81, 95, 96, 97, 127, 128, 129, 160, 191, 192, 193, 255, 300};
constexpr Weights kWeights[] = {Weights::none, Weights::random, Weights::with_holes, Weights::full, Weights::nothing};

template <class Check>
void for_cases(std::size_t bytes_per_lane, std::initializer_list<unsigned> limits, Check&& check) {
  Random random(7);
  for (const std::size_t lanes : kLanes) {
    for (int rows = 1; rows <= kMostRows; ++rows) {
      for (const Weights weights : kWeights) {
        Case c{lanes, rows, 0, 0, weights, 0, random() % 4 != 0};
        const std::size_t padding[] = {0, 1, 37, 64, 700};
        c.stride = lanes * bytes_per_lane + padding[below(random, 5)];
        c.weight_stride = lanes + padding[below(random, 5)];
        c.clipped_from = limits.begin()[below(random, limits.size())];
        check(c, random);
        if (testing::Test::HasFatalFailure()) return;
      }
    }
  }
}

/// What is written to the picture between its rows belongs to others.
void fill(std::uint8_t* at, std::size_t bytes, unsigned how, Random& random) {
  for (std::size_t i = 0; i < bytes; ++i)
    at[i] = how == 0 ? 255 : how == 1 ? 0 : static_cast<std::uint8_t>(random() >> 8);
}

CodeTable16 rising_table() {
  CodeTable16 table;
  for (std::size_t i = 0; i < 256; ++i)
    table[i] = static_cast<std::uint16_t>(std::lround(65535 * std::pow(static_cast<double>(i) / 255, 2.2)));
  return table;
}

CodeTable16 any_table() {
  Random random(5);
  CodeTable16 table;
  for (std::uint16_t& v : table) v = static_cast<std::uint16_t>(random() >> 8);
  return table;
}

CodeTable16 full_table() {
  CodeTable16 table;
  table.fill(65535);
  return table;
}

TEST(LaneSums, OfCodesAreTheSumsDownTheRows) {
  const std::array<CodeTable16, 3> tables = {rising_table(), any_table(), full_table()};
  test::on_each_target([&](const char* target) {
    SCOPED_TRACE(target);
    Fenced picture(kMostRows * 1100), weighing(kMostRows * 1100);
    for_cases(1, {1, 128, 250, 255, 256, 1000}, [&](const Case& c, Random& random) {
      const std::size_t bytes = static_cast<std::size_t>(c.rows - 1) * c.stride + c.lanes;
      std::uint8_t* at = picture.place(bytes, c.at_the_end);
      fill(at, bytes, below(random, 6), random);
      const std::uint8_t* weights = put_weights(c, weighing, random);
      const std::size_t which = below(random, 4);
      const CodeTable16* table = which < 3 ? &tables[which] : nullptr;
      Sums got(c.lanes);
      const CodeRows rows{at, c.stride, c.rows, table, c.clipped_from};
      if (weights == nullptr)
        sum_lanes(rows, c.lanes, got.out());
      else
        sum_weighted_lanes(rows, weights, c.weight_stride, c.lanes, got.out());
      ASSERT_TRUE(got.guards_hold()) << c;
      for (std::size_t i = 0; i < c.lanes; ++i) {
        Lane lane;
        for (int y = 0; y < c.rows; ++y) {
          const auto row = static_cast<std::size_t>(y);
          const unsigned code = at[row * c.stride + i];
          const unsigned plain = table != nullptr ? (*table)[code] : weights != nullptr ? 257 * code : code;
          const unsigned weight = weights != nullptr ? weights[row * c.weight_stride + i] : 256;
          // Each product is cut off, so that all vector units agree to the bit.
          lane.add(code, plain * weight / 256, static_cast<unsigned>(c.rows - y), weight > 0, c.clipped_from);
        }
        ASSERT_EQ(got.sum[i], lane.sum) << c << ", lane " << i << ", table " << which;
        ASSERT_EQ(got.early[i], lane.early) << c << ", lane " << i << ", table " << which;
        ASSERT_EQ(got.peak[i], lane.peak) << c << ", lane " << i;
        ASSERT_EQ(got.clipped[i], lane.clipped) << c << ", lane " << i;
      }
    });
  });
}

TEST(LaneSums, OfWordsAreTheSumsDownTheRowsOfTheirLowBits) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    Fenced picture(kMostRows * 1400), weighing(kMostRows * 1100);
    for_cases(2, {1, 512, 1003, 1023, 4014, 4095, 4096, 65535, 65536, 100000}, [&](const Case& c, Random& random) {
      const std::size_t bytes = static_cast<std::size_t>(c.rows - 1) * c.stride + 2 * c.lanes;
      std::uint8_t* at = picture.place(bytes, c.at_the_end);
      fill(at, bytes, below(random, 6), random);
      const std::uint8_t* weights = put_weights(c, weighing, random);
      const std::uint16_t mask = random() % 2 == 0 ? 1023 : 4095;
      Sums got(c.lanes);
      const WordRows rows{at, c.stride, c.rows, mask, c.clipped_from};
      if (weights == nullptr)
        sum_wide_lanes(rows, c.lanes, got.out());
      else
        sum_weighted_wide_lanes(rows, weights, c.weight_stride, c.lanes, got.out());
      ASSERT_TRUE(got.guards_hold()) << c;
      for (std::size_t i = 0; i < c.lanes; ++i) {
        Lane lane;
        for (int y = 0; y < c.rows; ++y) {
          const auto row = static_cast<std::size_t>(y);
          const std::uint8_t* pixel = at + row * c.stride + 2 * i;
          const unsigned word = (pixel[0] | static_cast<unsigned>(pixel[1]) << 8) & mask;
          const unsigned weight = weights != nullptr ? weights[row * c.weight_stride + i] : 256;
          const unsigned linear = weights != nullptr ? 16 * word * weight / 256 : word;
          lane.add(word, linear, static_cast<unsigned>(c.rows - y), weight > 0, c.clipped_from);
        }
        ASSERT_EQ(got.sum[i], lane.sum) << c << ", lane " << i << ", mask " << mask;
        ASSERT_EQ(got.early[i], lane.early) << c << ", lane " << i << ", mask " << mask;
        ASSERT_EQ(got.peak[i], lane.peak) << c << ", lane " << i;
        ASSERT_EQ(got.clipped[i], lane.clipped) << c << ", lane " << i;
      }
    });
  });
}

TEST(LaneSums, EachCodeHasItsOwnLinearValue) {
  // A code that a shuffle takes from the wrong place of the table might hide among sums of many.
  const CodeTable16 table = any_table();
  test::on_each_target([&](const char* target) {
    SCOPED_TRACE(target);
    std::array<std::uint8_t, 256> row, weights;
    for (std::size_t i = 0; i < 256; ++i) row[i] = static_cast<std::uint8_t>(i * 77 + 3);
    for (int weight = 0; weight < 256; ++weight) {
      weights.fill(static_cast<std::uint8_t>(weight));
      Sums plain(256), weighted(256);
      const CodeRows rows{row.data(), 256, 1, &table, 256};
      sum_lanes(rows, 256, plain.out());
      sum_weighted_lanes(rows, weights.data(), 256, 256, weighted.out());
      for (std::size_t i = 0; i < 256; ++i) {
        const unsigned linear = table[row[i]];
        ASSERT_EQ(plain.sum[i], linear) << "code " << int{row[i]};
        ASSERT_EQ(weighted.sum[i], linear * static_cast<unsigned>(weight) / 256) << "code " << int{row[i]};
      }
    }
  });
}

TEST(LaneSums, FirstMomentComesFromTheEarlySums) {
  // A single row that is lit, at each depth: rows * sum - early is its depth times its light.
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    for (int rows = 1; rows <= kMostRows; ++rows) {
      for (int lit = 0; lit < rows; ++lit) {
        std::vector<std::uint8_t> picture(static_cast<std::size_t>(rows) * 64);
        std::fill_n(picture.begin() + lit * 64, 64, std::uint8_t{200});
        Sums got(64);
        sum_lanes({picture.data(), 64, rows, nullptr, 256}, 64, got.out());
        ASSERT_EQ(static_cast<unsigned>(rows) * got.sum[17] - got.early[17], static_cast<unsigned>(lit) * 200);
      }
    }
  });
}

TEST(BlockSums, OfLanesAreTheSumsOfTheirColumns) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    Random random(9);
    for (const int edge : {1, 2, 4, 8, 16}) {
      for (int channels = 1; channels <= 3; ++channels) {
        for (const std::size_t blocks : {1U, 2U, 3U, 5U, 7U, 8U, 15U, 16U, 17U, 31U, 33U, 40U, 81U}) {
          const auto columns = static_cast<std::size_t>(edge), count = static_cast<std::size_t>(channels);
          const std::size_t lanes = blocks * columns * count, room = lanes + kFewestLanes;
          Sums got(room);
          Guarded<std::uint32_t> across(room);
          const bool full = random() % 3 == 0;
          for (std::size_t i = 0; i < room; ++i) {
            // The largest that 16 rows of 65535 give, and beyond the lanes anything at all.
            const bool beyond = i >= lanes;
            got.sum.data()[i] = beyond ? static_cast<std::uint32_t>(random()) : full ? 16 * 65535U : below(random, 16 * 65535);
            got.early.data()[i] = beyond ? static_cast<std::uint32_t>(random()) : full ? 136 * 65535U : below(random, 136 * 65535);
            got.peak.data()[i] = static_cast<std::uint16_t>(random());
            across.data()[i] = static_cast<std::uint32_t>(random());
          }
          const Sums in = got;
          sum_blocks(got.out(), channels, edge, blocks, across.data());
          ASSERT_TRUE(got.guards_hold() && across.guards_hold());
          for (std::size_t block = 0; block < blocks; ++block) {
            for (std::size_t c = 0; c < count; ++c) {
              std::uint64_t sum = 0, early = 0, moved = 0;
              unsigned peak = 0;
              for (std::size_t column = 0; column < columns; ++column) {
                const std::size_t lane = (block * columns + column) * count + c;
                sum += in.sum[lane];
                early += in.early[lane];
                moved += column * in.sum[lane];
                peak = std::max<unsigned>(peak, in.peak[lane]);
              }
              const std::size_t at = block * count + c;
              const auto what = testing::Message() << "edge " << edge << ", " << channels << " channels, block " << block
                                                   << " of " << blocks << ", channel " << c;
              ASSERT_EQ(got.sum[at], sum) << what;
              ASSERT_EQ(got.early[at], early) << what;
              ASSERT_EQ(across[at], moved) << what;
              ASSERT_EQ(got.peak[at], peak) << what;
            }
          }
        }
      }
    }
  });
}

struct Planes {
  Guarded<std::uint8_t> r, g, b;
  explicit Planes(std::size_t n) : r(n), g(n), b(n) {}
  [[nodiscard]] bool guards_hold() const { return r.guards_hold() && g.guards_hold() && b.guards_hold(); }
};

TEST(YcbcrPlanes, HoldTheColourOfEveryTripleOfBytes) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    std::array<std::uint8_t, 256> luma, chroma;
    std::array<std::uint8_t, 512> yuyv;
    for (std::size_t i = 0; i < 256; ++i) luma[i] = static_cast<std::uint8_t>(i);
    Planes of_nv12(256), of_yuyv(256);
    std::uint64_t wrong = 0;
    for (int cb = 0; cb < 256; ++cb) {
      for (int cr = 0; cr < 256; ++cr) {
        for (std::size_t i = 0; i < 256; ++i) {
          chroma[i] = static_cast<std::uint8_t>(i % 2 == 0 ? cb : cr);
          yuyv[2 * i] = luma[i];
          yuyv[2 * i + 1] = chroma[i];
        }
        planes_of_nv12(luma.data(), chroma.data(), 256, of_nv12.r.data(), of_nv12.g.data(), of_nv12.b.data());
        planes_of_yuyv(yuyv.data(), 256, of_yuyv.r.data(), of_yuyv.g.data(), of_yuyv.b.data());
        for (std::size_t y = 0; y < 256; ++y) {
          const auto rgb = rgb8_of_ycbcr601(static_cast<int>(y), cb, cr);
          wrong += of_nv12.r[y] != rgb[0] || of_nv12.g[y] != rgb[1] || of_nv12.b[y] != rgb[2];
          wrong += of_yuyv.r[y] != rgb[0] || of_yuyv.g[y] != rgb[1] || of_yuyv.b[y] != rgb[2];
        }
        ASSERT_EQ(wrong, 0U) << "Cb " << cb << ", Cr " << cr;
      }
    }
    EXPECT_TRUE(of_nv12.guards_hold() && of_yuyv.guards_hold());
  });
}

TEST(YcbcrPlanes, AreReadFromTheirRowAlone) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    Random random(3);
    Fenced first(2048), second(2048);
    for (std::size_t pixels = kFewestLanes; pixels <= 400; pixels += 2) {
      for (const bool at_the_end : {false, true}) {
        std::uint8_t* yuyv = first.place(2 * pixels, at_the_end);
        fill(yuyv, 2 * pixels, 2, random);
        Planes got(pixels);
        planes_of_yuyv(yuyv, pixels, got.r.data(), got.g.data(), got.b.data());
        ASSERT_TRUE(got.guards_hold()) << pixels;
        for (std::size_t x = 0; x < pixels; ++x) {
          const std::size_t pair = x / 2 * 4;
          const auto rgb = rgb8_of_ycbcr601(yuyv[2 * x], yuyv[pair + 1], yuyv[pair + 3]);
          ASSERT_TRUE(got.r[x] == rgb[0] && got.g[x] == rgb[1] && got.b[x] == rgb[2]) << x << " of " << pixels;
        }
        std::uint8_t* luma = first.place(pixels, at_the_end);
        std::uint8_t* chroma = second.place(pixels, at_the_end);
        fill(luma, pixels, 2, random);
        fill(chroma, pixels, 2, random);
        planes_of_nv12(luma, chroma, pixels, got.r.data(), got.g.data(), got.b.data());
        ASSERT_TRUE(got.guards_hold()) << pixels;
        for (std::size_t x = 0; x < pixels; ++x) {
          const auto rgb = rgb8_of_ycbcr601(luma[x], chroma[x / 2 * 2], chroma[x / 2 * 2 + 1]);
          ASSERT_TRUE(got.r[x] == rgb[0] && got.g[x] == rgb[1] && got.b[x] == rgb[2]) << x << " of " << pixels;
        }
      }
    }
  });
}

TEST(WeightedRows, AreAddedToWithinTheRoundingOfFloats) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    Random random(11);
    std::normal_distribution<float> normal;
    Fenced row_memory(301 * kRowFloats * sizeof(float)), weight_memory(301 * 3 * sizeof(float));
    for (const std::size_t count : {0U, 1U, 2U, 3U, 7U, 16U, 255U, 256U, 257U, 300U}) {
      for (const bool at_the_end : {false, true}) {
        auto* rows = reinterpret_cast<float*>(row_memory.place(count * kRowFloats * sizeof(float), at_the_end));
        auto* weights = reinterpret_cast<float*>(weight_memory.place(count * 3 * sizeof(float), at_the_end));
        for (std::size_t i = 0; i < count * kRowFloats; ++i) rows[i] = normal(random);
        for (std::size_t i = 0; i < count * 3; ++i) weights[i] = std::exp(3 * normal(random));
        struct {
          float before[64], out[3][kRowFloats], after[64];
        } got;
        for (auto* guard : {&got.before, &got.after}) std::fill(std::begin(*guard), std::end(*guard), 12345.0F);
        for (auto& channel : got.out)
          for (float& v : channel) v = normal(random);
        const auto in = got;
        add_weighted_rows(rows, weights, count, got.out);
        for (const auto* guard : {&got.before, &got.after})
          for (const float v : *guard) ASSERT_EQ(v, 12345.0F);
        for (std::size_t c = 0; c < 3; ++c) {
          for (std::size_t i = 0; i < kRowFloats; ++i) {
            double sum = in.out[c][i], amount = std::abs(sum);
            for (std::size_t k = 0; k < count; ++k) {
              const double product = static_cast<double>(weights[3 * k + c]) * rows[k * kRowFloats + i];
              sum += product;
              amount += std::abs(product);
            }
            // n terms added one after another, each product rounded at most once more: Higham, "Accuracy and Stability
            // of Numerical Algorithms" (2002), eq. 3.4, with the unit roundoff 2^-24.
            ASSERT_NEAR(got.out[c][i], sum, static_cast<double>(count + 2) * std::exp2(-24) * amount)
                << count << " rows, channel " << c << ", number " << i;
          }
        }
      }
    }
  });
}

TEST(VectorUnits, AreAllThoseThatThisMachineHas) {
  // Without the flags of the kernels' own files the loops above would skip the widest or go through none.
  std::vector<std::string> names;
  test::on_each_target([&](const char* target) { names.emplace_back(target); });
  ASSERT_FALSE(names.empty());
  for (const std::string& name : names) {
    EXPECT_NE(name, "SCALAR") << "the kernels are not compiled for it";
    EXPECT_NE(name, "EMU128") << "the kernels are not compiled for it";
  }
}

}  // namespace
}  // namespace lightwell::estimate
