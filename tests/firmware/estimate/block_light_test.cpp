// From sums of codes to light, on every vector unit: what the formulas say in double, and nothing beyond the last
// block.
#include "estimate/panorama/kernels/block_light.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "estimate/common/row_reader.hpp"
#include "firmware/estimate/each_target.hpp"

namespace lightwell::estimate {
namespace {

constexpr std::size_t kMost = 67;
constexpr float kGuard = 12345;

/// A run of blocks as CodePass would hand it over; what lies beyond is not a number.
struct Made {
  explicit Made(std::size_t blocks, bool weighted, std::uint32_t seed) : count(blocks), random(seed) {
    run.weighted = weighted;
    run.unit = 3e-5F;
    run.plain_unit = 4e-3F;
    run.linear_from = -0.02F;
    run.cut_off = 0.498F;
    run.half_y = 3.5F;
    run.radiance = 40;
    run.white = {1.1F, 1, 0.9F};
    run.luminance = {0.23F, 0.71F, 0.06F};
    run.read2 = 1e-6F, run.shot = 2e-4F, run.cut_noise = 1e-3F;
    step.resize(4096);
    for (std::size_t i = 0; i < step.size(); ++i) step[i] = 1e-3F + 1e-6F * static_cast<float>(i);
    for (auto& numbers : worths) numbers = drawn(0.01F, 1);
    for (auto& numbers : sums) numbers = drawn(0, 2e4F);
    for (auto& numbers : tops) numbers = drawn(0, 200);
    clipped = drawn(0, 3);
    // All dark, and all saturated.
    if (blocks > 2) {
      for (auto& numbers : sums) numbers[1] = 0;
      for (std::size_t c = 0; c < 3; ++c) sums[c][2] = 1e8F;
    }
  }

  std::vector<float> drawn(float least, float most) {
    std::uniform_real_distribution<float> value(least, most);
    std::vector<float> out(count + kBlockLightPadding, std::numeric_limits<float>::quiet_NaN());
    for (std::size_t b = 0; b < count; ++b) out[b] = value(random);
    return out;
  }
  [[nodiscard]] BlockWeights weights() const {
    const auto at = [&](std::size_t k) { return worths[k].data(); };
    return {at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7), at(8), at(9), at(10), at(11), at(12), at(13)};
  }
  BlockCodes codes() {
    const auto three = [](auto& all, std::size_t from) {
      return std::array{all[from].data(), all[from + 1].data(), all[from + 2].data()};
    };
    return {three(sums, 0), three(sums, 3), three(sums, 6), three(tops, 0), clipped.data()};
  }

  std::size_t count;
  std::mt19937 random;
  BlockRun run;
  std::vector<float> step;
  std::array<std::vector<float>, 14> worths;
  std::array<std::vector<float>, 9> sums;
  std::array<std::vector<float>, 3> tops;
  std::vector<float> clipped;
};

struct Truth {
  std::array<double, 3> light{};
  double peak = 0, offset_x = 0, offset_y = 0, clipped_sr = 0, noise = 0, bias = 0;
};

Truth truth_of(Made& made, std::size_t b) {
  const BlockRun& r = made.run;
  const BlockWeights w = made.weights();
  const BlockCodes codes = made.codes();
  std::array<double, 3> mean{};
  double sum = 0, across = 0, down = 0, brightest = 0;
  Truth out;
  for (std::size_t c = 0; c < 3; ++c) {
    const double s = codes.sum[c][b], x = codes.across[c][b], y = codes.down[c][b], weight = r.luminance[c];
    double own, light, own_across, own_down;
    if (r.weighted) {
      own = light =
          double(r.unit) * w.unit[b] * (s + double(r.cut_off) * w.pixels[b]) + double(r.linear_from) * w.total[b];
      mean[c] = light * w.per_total[b];
      own_across = double(r.unit) * w.unit[b] * (x - w.middle_x[b] * s);
      own_down = double(r.unit) * w.unit[b] * (y - w.middle_y[b] * s);
    } else {
      own = r.unit * s + double(r.linear_from) * w.pixels[b];
      own_across = r.unit * (x - w.half_x[b] * s);
      own_down = r.unit * (y - r.half_y * s);
      light = w.mean[b] * own + w.along_x[b] * own_across + w.along_y[b] * own_down;
      mean[c] = own * w.per_pixel[b];
    }
    sum += weight * own;
    across += weight * own_across;
    down += weight * own_down;
    brightest += weight * (codes.top[c][b] * double(r.plain_unit) + r.linear_from);
    out.light[c] = light * r.radiance * r.white[c];
  }
  out.peak = std::max(0.0, brightest * w.inverse_vignetting[b] * r.radiance);
  out.offset_x = sum > 0 ? across / sum : 0;
  out.offset_y = sum > 0 ? down / sum : 0;
  const double largest = std::clamp(std::max({mean[0], mean[1], mean[2]}), 0.0, 1.0);
  const float step = r.step == nullptr ? r.plain_unit : r.step[static_cast<std::size_t>(largest * 4095)];
  out.noise = w.spread[b] * (r.read2 + r.shot * std::max(mean[1], 0.0) + double(step) * step / 12);
  out.bias = w.total[b] * double(near_black_bias(static_cast<float>(mean[1]), step, r.cut_noise));
  out.clipped_sr = w.solid_angle[b] * std::min(1.0, double(made.clipped[b]) * w.per_pixel[b]);
  return out;
}

TEST(BlockLight, IsWhatTheFormulasSayInDouble) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    for (const bool weighted : {false, true}) {
      for (const bool stepped : {false, true}) {
        for (const std::size_t blocks : {std::size_t{1}, std::size_t{3}, std::size_t{15}, std::size_t{16}, kMost}) {
          Made made(blocks, weighted, 7);
          if (stepped) made.run.step = made.step.data();
          std::vector<CellSum> light(kMost + 1, {kGuard, kGuard, kGuard});
          std::array<std::vector<float>, 4> more;
          more.fill(std::vector<float>(kMost + 1, kGuard));
          const BlockErrorSums doubt =
              convert_block_sums(made.run, made.weights(), made.codes(), blocks,
                              {light.data(), more[0].data(), more[1].data(), more[2].data(), more[3].data()});
          Truth all;
          for (std::size_t b = 0; b < blocks; ++b) {
            const Truth t = truth_of(made, b);
            // A dozen roundings of 2^-24 of terms that cancel to a tenth of the largest; a step is another one where
            // its index rounds the other way, 0.1 % of it.
            const auto near = [](double got, double truth, double scale) {
              return std::abs(got - truth) <= 1e-5 * (std::abs(truth) + scale);
            };
            const float rgb[] = {light[b].r, light[b].g, light[b].b};
            for (std::size_t c = 0; c < 3; ++c)
              EXPECT_TRUE(near(rgb[c], t.light[c], 10)) << b << " " << rgb[c] << " " << t.light[c];
            EXPECT_TRUE(near(more[0][b], t.peak, 0.1)) << b;
            EXPECT_TRUE(near(more[1][b], t.offset_x, 10)) << b << " " << more[1][b] << " " << t.offset_x;
            EXPECT_TRUE(near(more[2][b], t.offset_y, 10)) << b;
            EXPECT_TRUE(near(more[3][b], t.clipped_sr, 0)) << b;
            all.noise += t.noise, all.bias += t.bias, all.clipped_sr += t.clipped_sr;
          }
          EXPECT_NEAR(doubt.noise, all.noise, 1e-4 * all.noise);
          EXPECT_NEAR(doubt.bias, all.bias, 1e-4 * all.bias + 1e-9);
          EXPECT_NEAR(doubt.clipped_sr, all.clipped_sr, 1e-5 * all.clipped_sr);
          EXPECT_EQ(light[blocks].r, kGuard);
          for (const auto& values : more) EXPECT_EQ(values[blocks], kGuard);
        }
      }
    }
  });
}

}  // namespace
}  // namespace lightwell::estimate
