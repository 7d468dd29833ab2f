// Sums over the rows of a block equal their definition on every Highway target, without accesses out of bounds.
#include "estimate/panorama/kernels/lane_sums.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "firmware/estimate/each_target.hpp"
#include "firmware/estimate/kernel_memory.hpp"

namespace lightwell::estimate {
namespace {

/// Sums of one lane by the definition in lane_sums.hpp.
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

/// Fills weights at the beginning or the end of their memory.
const std::uint8_t* put_weights(const Case& c, Fenced& memory, Random& random) {
  if (c.weights == Weights::none) return nullptr;
  const std::size_t bytes = static_cast<std::size_t>(c.rows - 1) * c.weight_stride + c.lanes;
  std::uint8_t* at = memory.place(bytes, c.at_the_end);
  for (std::size_t i = 0; i < bytes; ++i) {
    const auto any = static_cast<std::uint8_t>(random());
    at[i] = c.weights == Weights::full                              ? 255
            : c.weights == Weights::nothing                         ? 0
            : c.weights == Weights::with_holes && random() % 3 == 0 ? 0
                                                                    : any;
  }
  return at;
}

/// Lengths around multiples of all vector widths, from kMinLanes on.
constexpr std::size_t kLanes[] = {64, 65, 66, 79, 80, 81, 95, 96, 97, 127, 128, 129, 160, 191, 192, 193, 255, 300};
constexpr Weights kWeights[] = {Weights::none, Weights::random, Weights::with_holes, Weights::full, Weights::nothing};

template <class Check>
void for_cases(std::size_t bytes_per_lane, std::initializer_list<unsigned> limits, Check&& check) {
  Random random(7);
  for (const std::size_t lanes : kLanes) {
    for (int rows = 1; rows <= kMaxRows; ++rows) {
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

template <class Value>
CodeTable table_of(Value&& value) {
  std::array<double, 256> linear{};
  for (std::size_t i = 0; i < linear.size(); ++i) linear[i] = value(i);
  return CodeTable(linear);
}
CodeTable rising_table() {
  return table_of([](std::size_t i) { return 65535 * std::pow(static_cast<double>(i) / 255, 2.2); });
}
CodeTable any_table() {
  Random random(5);
  return table_of([&](std::size_t) { return static_cast<double>(random() >> 8 & 65535); });
}
/// Concave from the middle on: negative curvatures.
CodeTable s_shaped_table() {
  return table_of([](std::size_t i) {
    const double v = static_cast<double>(i) / 255;
    return 65535 * v * v * (3 - 2 * v);
  });
}
CodeTable full_table() {
  return table_of([](std::size_t) { return 65535.0; });
}

TEST(LaneSums, SumCodesOverRows) {
  const std::array tables = {rising_table(), any_table(), full_table()};
  test::on_each_target([&](const char* target) {
    SCOPED_TRACE(target);
    Fenced picture(kMaxRows * 1100), weighing(kMaxRows * 1100);
    for_cases(1, {1, 128, 250, 255, 256, 1000}, [&](const Case& c, Random& random) {
      const std::size_t bytes = static_cast<std::size_t>(c.rows - 1) * c.stride + c.lanes;
      std::uint8_t* at = picture.place(bytes, c.at_the_end);
      fill(at, bytes, below(random, 6), random);
      const std::uint8_t* weights = put_weights(c, weighing, random);
      const std::size_t which = below(random, 4);
      const CodeTable* table = which < 3 ? &tables[which] : nullptr;
      Sums got(c.lanes);
      const CodeRows rows{at, c.stride, c.rows, table, c.clipped_from};
      sum_lanes(rows, {weights, c.weight_stride}, c.lanes, got.out());
      ASSERT_TRUE(got.guards_hold()) << c;
      for (std::size_t i = 0; i < c.lanes; ++i) {
        Lane lane;
        for (int y = 0; y < c.rows; ++y) {
          const auto row = static_cast<std::size_t>(y);
          const unsigned code = at[row * c.stride + i];
          const unsigned plain = table != nullptr ? (*table)[code] : weights != nullptr ? 257 * code : code;
          const unsigned weight = weights != nullptr ? weights[row * c.weight_stride + i] : 256;
          // Each product is truncated, so that all targets agree bit for bit.
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

TEST(LaneSums, SumMaskedWordsOverRows) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    Fenced picture(kMaxRows * 1400), weighing(kMaxRows * 1100);
    for_cases(2, {1, 512, 1003, 1023, 4014, 4095, 4096, 65535, 65536, 100000}, [&](const Case& c, Random& random) {
      const std::size_t bytes = static_cast<std::size_t>(c.rows - 1) * c.stride + 2 * c.lanes;
      std::uint8_t* at = picture.place(bytes, c.at_the_end);
      fill(at, bytes, below(random, 6), random);
      const std::uint8_t* weights = put_weights(c, weighing, random);
      const std::uint16_t mask = random() % 2 == 0 ? 1023 : 4095;
      Sums got(c.lanes);
      const WordRows rows{at, c.stride, c.rows, mask, c.clipped_from};
      sum_wide_lanes(rows, {weights, c.weight_stride}, c.lanes, got.out());
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
  // A wrong table entry might not be detected in sums of many codes.
  ASSERT_EQ(any_table().segments(), nullptr);
  ASSERT_NE(rising_table().segments(), nullptr);
  ASSERT_NE(s_shaped_table().segments(), nullptr);
  const std::array tables = {any_table(), rising_table(), s_shaped_table()};
  test::on_each_target([&](const char* target) {
    SCOPED_TRACE(target);
    for (const CodeTable& table : tables) {
      std::array<std::uint8_t, 256> row, weights;
      for (std::size_t i = 0; i < 256; ++i) row[i] = static_cast<std::uint8_t>(i * 77 + 3);
      for (int weight = 0; weight < 256; ++weight) {
        weights.fill(static_cast<std::uint8_t>(weight));
        Sums plain(256), weighted(256);
        const CodeRows rows{row.data(), 256, 1, &table, 256};
        sum_lanes(rows, {}, 256, plain.out());
        sum_lanes(rows, {weights.data(), 256}, 256, weighted.out());
        for (std::size_t i = 0; i < 256; ++i) {
          const unsigned linear = table[row[i]];
          ASSERT_EQ(plain.sum[i], linear) << "code " << int{row[i]};
          ASSERT_EQ(weighted.sum[i], linear * static_cast<unsigned>(weight) / 256) << "code " << int{row[i]};
        }
      }
    }
  });
}

TEST(LaneSums, EarlySumsGiveTheFirstMoment) {
  // One nonzero row at each depth: rows * sum - early is its depth times its sum.
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    for (int rows = 1; rows <= kMaxRows; ++rows) {
      for (int lit = 0; lit < rows; ++lit) {
        std::vector<std::uint8_t> picture(static_cast<std::size_t>(rows) * 64);
        std::fill_n(picture.begin() + lit * 64, 64, std::uint8_t{200});
        Sums got(64);
        sum_lanes({picture.data(), 64, rows, nullptr, 256}, {}, 64, got.out());
        ASSERT_EQ(static_cast<unsigned>(rows) * got.sum[17] - got.early[17], static_cast<unsigned>(lit) * 200);
      }
    }
  });
}

TEST(HighwayTargets, ExcludeScalarFallbacks) {
  // Without the kernels' target flags, the loops above would skip the widest target or all of them.
  std::vector<std::string> names;
  test::on_each_target([&](const char* target) { names.emplace_back(target); });
  ASSERT_FALSE(names.empty());
  for (const std::string& name : names) {
    EXPECT_NE(name, "SCALAR") << "the kernels are not compiled for this target";
    EXPECT_NE(name, "EMU128") << "the kernels are not compiled for this target";
  }
}

}  // namespace
}  // namespace lightwell::estimate
