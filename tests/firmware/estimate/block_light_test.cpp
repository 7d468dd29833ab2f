// Conversion of code sums to light on every Highway target: equals the formulas in double, and writes nothing beyond
// the last block.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "estimate/frames/row_reader.hpp"
#include "estimate/panorama/kernels/lane_sums.hpp"
#include "firmware/estimate/each_target.hpp"

namespace lightwell::estimate {
namespace {

constexpr std::size_t kMaxTestBlocks = 67;
constexpr float kGuard = 12345;

/// A run of blocks as CodePass passes it; padding is NaN.
struct TestRun {
  explicit TestRun(std::size_t blocks, bool weighted, std::uint32_t seed) : count(blocks), random(seed) {
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
    for (auto& numbers : block_weights) numbers = random_values(0.01F, 1);
    for (auto& numbers : sums) numbers = random_values(0, 2e4F);
    for (auto& numbers : tops) numbers = random_values(0, 200);
    clipped = random_values(0, 3);
    // A dark block, and a saturated one.
    if (blocks > 2) {
      for (auto& numbers : sums) numbers[1] = 0;
      for (std::size_t c = 0; c < 3; ++c) sums[c][2] = 1e8F;
    }
  }

  std::vector<float> random_values(float least, float most) {
    std::uniform_real_distribution<float> value(least, most);
    std::vector<float> out(count + kBlockLightPadding, std::numeric_limits<float>::quiet_NaN());
    for (std::size_t b = 0; b < count; ++b) out[b] = value(random);
    return out;
  }
  [[nodiscard]] BlockWeights weights() const {
    const auto at = [&](std::size_t k) { return block_weights[k].data(); };
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
  std::array<std::vector<float>, 14> block_weights;
  std::array<std::vector<float>, 9> sums;
  std::array<std::vector<float>, 3> tops;
  std::vector<float> clipped;
};

struct Truth {
  std::array<double, 3> light{};
  double peak = 0, offset_x = 0, offset_y = 0, clipped_sr = 0, noise = 0, bias = 0;
};

Truth truth_of(TestRun& test_run, std::size_t b) {
  const BlockRun& r = test_run.run;
  const BlockWeights w = test_run.weights();
  const BlockCodes codes = test_run.codes();
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
  out.noise = double(r.radiance) * r.radiance * w.spread[b] *
              (r.read2 + r.shot * std::max(mean[1], 0.0) + double(step) * step / 12);
  out.bias = double(r.radiance) * w.total[b] * double(near_black_bias(static_cast<float>(mean[1]), step, r.cut_noise));
  out.clipped_sr = w.solid_angle[b] * std::min(1.0, double(test_run.clipped[b]) * w.per_pixel[b]);
  return out;
}

TEST(BlockLight, EqualsTheFormulasInDouble) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    for (const bool weighted : {false, true}) {
      for (const bool with_steps : {false, true}) {
        for (const std::size_t blocks :
             {std::size_t{1}, std::size_t{3}, std::size_t{15}, std::size_t{16}, kMaxTestBlocks}) {
          TestRun test_run(blocks, weighted, 7);
          if (with_steps) test_run.run.step = test_run.step.data();
          std::vector<CellSum> light(kMaxTestBlocks + 1, {kGuard, kGuard, kGuard});
          std::array<std::vector<float>, 6> outputs;
          outputs.fill(std::vector<float>(kMaxTestBlocks + 1, kGuard));
          const BlockErrorSums error_sums =
              convert_block_sums(test_run.run, test_run.weights(), test_run.codes(), blocks,
                                 {light.data(), outputs[0].data(), outputs[1].data(), outputs[2].data(),
                                  outputs[3].data(), outputs[4].data(), outputs[5].data()});
          Truth all;
          for (std::size_t b = 0; b < blocks; ++b) {
            const Truth t = truth_of(test_run, b);
            // Tolerance: a dozen roundings of 2^-24 of terms that cancel to a tenth of the largest; where its index
            // rounds differently, a step differs by 0.1 %.
            const auto near = [](double got, double truth, double scale) {
              return std::abs(got - truth) <= 1e-5 * (std::abs(truth) + scale);
            };
            const float rgb[] = {light[b].r, light[b].g, light[b].b};
            for (std::size_t c = 0; c < 3; ++c)
              EXPECT_TRUE(near(rgb[c], t.light[c], 10)) << b << " " << rgb[c] << " " << t.light[c];
            EXPECT_TRUE(near(outputs[0][b], t.peak, 0.1)) << b;
            EXPECT_TRUE(near(outputs[1][b], t.offset_x, 10)) << b << " " << outputs[1][b] << " " << t.offset_x;
            EXPECT_TRUE(near(outputs[2][b], t.offset_y, 10)) << b;
            EXPECT_TRUE(near(outputs[3][b], t.clipped_sr, 0)) << b;
            // A step that differs by 0.1 % is squared.
            EXPECT_NEAR(outputs[4][b], t.noise, 2e-3 * t.noise) << b;
            EXPECT_NEAR(outputs[5][b], t.bias, 2e-3 * t.bias + 1e-9) << b;
            all.noise += t.noise, all.bias += t.bias, all.clipped_sr += t.clipped_sr;
          }
          EXPECT_NEAR(error_sums.noise, all.noise, 1e-4 * all.noise);
          EXPECT_NEAR(error_sums.bias, all.bias, 1e-4 * all.bias + 1e-9);
          EXPECT_NEAR(error_sums.clipped_sr, all.clipped_sr, 1e-5 * all.clipped_sr);
          EXPECT_EQ(light[blocks].r, kGuard);
          for (const auto& values : outputs) EXPECT_EQ(values[blocks], kGuard);
        }
      }
    }
  });
}

}  // namespace
}  // namespace lightwell::estimate
