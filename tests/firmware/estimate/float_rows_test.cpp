// Rows of floats are added to column sums on every Highway target, at any alignment.
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "estimate/panorama/kernels/bracket_rows.hpp"
#include "firmware/estimate/each_target.hpp"
#include "firmware/estimate/kernel_memory.hpp"

namespace lightwell::estimate {
namespace {

constexpr float kMaxRadiance = 1e30F;

/// Arrays of all five sums, with guards.
struct Columns {
  Guarded<float> r, g, b, low, peak;
  explicit Columns(std::size_t n) : r(n), g(n), b(n), low(n), peak(n) {}
  FloatColumns out() { return {r.data(), g.data(), b.data(), low.data(), peak.data()}; }
  [[nodiscard]] bool guards_hold() const {
    return r.guards_hold() && g.guards_hold() && b.guards_hold() && low.guards_hold() && peak.guards_hold();
  }
};

/// A row of pixels and solid angles between fences.
class Row {
 public:
  static constexpr std::size_t kMost = 300;

  Row(std::size_t pixels, bool at_the_end, std::size_t misaligned, Random& random) : pixels_(pixels) {
    // At the end of the memory, the alignment depends on the length.
    rgb_ = colors_.place(12 * pixels + (at_the_end ? 0 : misaligned), at_the_end) + (at_the_end ? 0 : misaligned);
    auto* sr = reinterpret_cast<float*>(weights_.place(4 * pixels, at_the_end));
    std::exponential_distribution<float> light(0.1F);
    for (std::size_t i = 0; i < 3 * pixels; ++i) set(i, light(random));
    for (std::size_t i = 0; i < pixels; ++i) sr[i] = random() % 5 == 0 ? 0 : 1e-5F * light(random);
    solid_angle_ = sr;
  }
  void set(std::size_t i, float v) { std::memcpy(rgb_ + 4 * i, &v, sizeof v); }
  [[nodiscard]] float get(std::size_t i) const {
    float v;
    std::memcpy(&v, rgb_ + 4 * i, sizeof v);
    return v;
  }
  [[nodiscard]] float sr(std::size_t i) const { return solid_angle_[i]; }
  [[nodiscard]] bool add(float scale, float depth, Columns& to) const {
    return add_float_row(reinterpret_cast<const std::byte*>(rgb_), solid_angle_, pixels_, scale, kMaxRadiance, depth,
                         to.out());
  }

 private:
  std::size_t pixels_;
  Fenced colors_{12 * kMost + 16}, weights_{4 * kMost};
  std::uint8_t* rgb_;
  const float* solid_angle_;
};

constexpr std::size_t kPixels[] = {1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 31, 32, 33, 63, 64, 65, 100, 300};

TEST(FloatRows, AreAddedToColumnSums) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    Random random(21);
    for (const std::size_t pixels : kPixels) {
      for (const bool at_the_end : {false, true}) {
        for (const std::size_t misaligned : {0U, 1U, 2U, 3U}) {
          const Row row(pixels, at_the_end, misaligned, random);
          Columns got(pixels);
          for (std::size_t i = 0; i < pixels; ++i) {
            const auto v = static_cast<float>(i);
            got.r.data()[i] = v, got.g.data()[i] = 2 * v, got.b.data()[i] = 3 * v, got.low.data()[i] = 4 * v,
            got.peak.data()[i] = v;
          }
          ASSERT_TRUE(row.add(0.25F, 5, got));
          ASSERT_TRUE(got.guards_hold());
          for (std::size_t i = 0; i < pixels; ++i) {
            const double c[3] = {0.25 * row.get(3 * i), 0.25 * row.get(3 * i + 1), 0.25 * row.get(3 * i + 2)},
                         a = row.sr(i);
            const double luminance = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2], v = static_cast<double>(i);
            // A sum, its product and three of the luminance, each rounded to 24 bits.
            const auto near = [](double of) { return 8 * std::exp2(-24) * std::abs(of) + 1e-30; };
            ASSERT_NEAR(got.r[i], v + c[0] * a, near(v + c[0] * a)) << i << " of " << pixels;
            ASSERT_NEAR(got.g[i], 2 * v + c[1] * a, near(2 * v + c[1] * a)) << i << " of " << pixels;
            ASSERT_NEAR(got.b[i], 3 * v + c[2] * a, near(3 * v + c[2] * a)) << i << " of " << pixels;
            ASSERT_NEAR(got.low[i], 4 * v + 5 * luminance * a, near(4 * v + 5 * luminance * a))
                << i << " of " << pixels;
            const double peak = std::max(v, a > 0 ? luminance : 0.0);
            ASSERT_NEAR(got.peak[i], peak, near(peak)) << i << " of " << pixels;
          }
        }
      }
    }
  });
}

TEST(FloatRows, WithInvalidValuesAreNotAdded) {
  constexpr float kInfinite = std::numeric_limits<float>::infinity();
  const float nonsense[] = {std::numeric_limits<float>::quiet_NaN(), -1e-20F, -kInfinite, kInfinite,
                            4.1F * kMaxRadiance};
  test::on_each_target([&](const char* target) {
    SCOPED_TRACE(target);
    Random random(22);
    for (const std::size_t pixels : {std::size_t{1}, std::size_t{5}, std::size_t{33}, std::size_t{64}}) {
      for (std::size_t at = 0; at < 3 * pixels; ++at) {
        Row row(pixels, true, 0, random);
        Columns got(pixels);
        for (std::size_t i = 0; i < pixels; ++i)
          for (float* column : {got.r.data(), got.g.data(), got.b.data(), got.low.data(), got.peak.data()})
            column[i] = 7;
        row.set(at, nonsense[at % std::size(nonsense)]);
        ASSERT_FALSE(row.add(0.25F, 5, got)) << at << " of " << pixels;
        for (std::size_t i = 0; i < pixels; ++i)
          for (const Guarded<float>* column : {&got.r, &got.g, &got.b, &got.low, &got.peak}) ASSERT_EQ((*column)[i], 7);
        // Zero of either sign and the largest radiance are valid.
        row.set(at, at % 2 == 0 ? -0.0F : kMaxRadiance);
        ASSERT_TRUE(row.add(0.25F, 5, got));
        ASSERT_TRUE(got.guards_hold());
      }
    }
  });
}

}  // namespace
}  // namespace lightwell::estimate
