// Alignment of photographs of a subject that moves.
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/relight_align.hpp>

namespace lightwell::test {
namespace {

constexpr int kColumns = 96, kRows = 64;

/// A texture that is moved by that many pixels to the right and half as many down.
std::vector<Radiance> texture(double shift, float gain) {
  std::vector<Radiance> out;
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column) {
      const double x = column - shift, y = row - 0.5 * shift;
      const auto v = static_cast<float>(0.5 + 0.2 * std::sin(0.35 * x + 0.1 * y) + 0.2 * std::sin(0.27 * y - 0.15 * x) +
                                        0.1 * std::sin(0.7 * x) * std::cos(0.6 * y));
      out.push_back({gain * v, gain * 0.5F * v, gain * 0.2F});
    }
  return out;
}

TEST(AlignPhotographs, ATextureThatMoves) {
  const auto first = texture(0, 1), second = texture(4, 1), still = texture(0, 0.3F);
  const auto middle = texture(2, 0.3F), late = texture(3, 0.3F);
  std::vector<std::vector<Radiance>> out;
  const auto summary = align_photographs(kColumns, kRows, {10, first}, {10.04, second},
                                         std::array{TimedPhotograph{10.02, middle}, TimedPhotograph{10.03, late}}, out);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_NEAR(summary->median_px, std::hypot(4, 2), 0.2);
  EXPECT_LT(summary->uncertain, first.size() / 10);
  ASSERT_EQ(out.size(), 2U);
  for (const auto& picture : out) {
    double squares = 0, before = 0;
    for (int row = 10; row < kRows - 10; ++row)
      for (int column = 10; column < kColumns - 10; ++column) {
        const auto p = static_cast<std::size_t>(row * kColumns + column);
        squares += std::pow(static_cast<double>(picture[p].r - still[p].r), 2);
        before += std::pow(static_cast<double>(middle[p].r - still[p].r), 2);
      }
    EXPECT_LT(squares, 0.02 * before);
  }
}

TEST(AlignPhotographs, NothingMoves) {
  const auto still = texture(0, 1);
  std::vector<std::vector<Radiance>> out;
  const auto summary =
      align_photographs(kColumns, kRows, {0, still}, {1, still}, std::array{TimedPhotograph{0.5, still}}, out);
  ASSERT_TRUE(summary.ok());
  EXPECT_LT(summary->largest_px, 0.1);
  EXPECT_EQ(summary->uncertain, 0U);
}

TEST(AlignPhotographs, BlackTrackingFramesMoveNothing) {
  const std::vector<Radiance> black(kColumns * kRows);
  std::vector<Radiance> damaged = texture(0, 1);
  damaged[5].r = std::numeric_limits<float>::quiet_NaN();
  std::vector<std::vector<Radiance>> out;
  const auto summary = align_photographs(kColumns, kRows, {0, black}, {1, black}, {}, out);
  ASSERT_TRUE(summary.ok());
  EXPECT_TRUE(std::isfinite(summary->largest_px));
  EXPECT_TRUE(align_photographs(kColumns, kRows, {0, damaged}, {1, damaged}, {}, out).ok());
}

TEST(AlignPhotographs, RefusesByName) {
  const auto still = texture(0, 1);
  std::vector<std::vector<Radiance>> out;
  const auto status = [&](const TimedPhotograph& a, const TimedPhotograph& b, const TimedPhotograph& p) {
    return align_photographs(kColumns, kRows, a, b, std::array{p}, out).status();
  };
  const auto refused = [](const Status& s, const std::string& part) {
    EXPECT_EQ(s.code(), StatusCode::invalid_argument);
    EXPECT_NE(s.message().find(part), std::string::npos) << s.message();
  };
  refused(status({0, still}, {1, still}, {1.5, still}), "photograph 0");
  refused(status({0, still}, {1, still}, {std::nan(""), still}), "photograph 0");
  refused(status({1, still}, {1, still}, {1, still}), "second tracking frame");
  refused(status({0, std::span(still).first(3)}, {1, still}, {1, still}), "first tracking frame");
  refused(align_photographs(8, 8, {0, {}}, {1, {}}, {}, out).status(), "16");
}

}  // namespace
}  // namespace lightwell::test
