// A table of linear values represents a response curve on every vector unit.
#include "estimate/panorama/kernels/code_table.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/pixel.hpp>

namespace lightwell::estimate {
namespace {

struct Curve {
  std::string name;
  std::array<double, 256> linear;
};

template <class OfValue>
Curve curve(std::string name, OfValue&& of_value) {
  Curve c{std::move(name), {}};
  for (std::size_t i = 0; i < 256; ++i) c.linear[i] = 65535 * of_value(static_cast<double>(i) / 255);
  return c;
}

double bt709(double v) { return v < 0.081 ? v / 4.5 : std::pow((v + 0.099) / 1.099, 1 / 0.45); }

/// sRGB that is 0 up to the code of black: a kink.
double above_black(double v, double black) { return std::max(srgb_to_linear(v) - black, 0.0) / (1 - black); }

std::vector<Curve> camera_curves() {
  std::vector<Curve> out = {curve("linear", [](double v) { return v; }),
                            curve("sRGB", srgb_to_linear),
                            curve("BT.709", bt709),
                            curve("S", [](double v) { return v * v * (3 - 2 * v); }),
                            curve("black", [](double) { return 0.0; }),
                            curve("white", [](double) { return 1.0; })};
  for (const double gamma : {1.0, 1.5, 1.8, 2.0, 2.2, 2.4, 2.6, 2.8, 3.0})
    out.push_back(curve("gamma " + std::to_string(gamma), [&](double v) { return std::pow(v, gamma); }));
  for (const double black : {0.001, 0.004, 0.016, 0.05})
    out.push_back(curve("black level " + std::to_string(black), [&](double v) { return above_black(v, black); }));
  return out;
}

TEST(CodeTable, SegmentsRepresentTheResponseCurvesOfCameras) {
  for (const Curve& c : camera_curves()) {
    SCOPED_TRACE(c.name);
    const CodeTable table(c.linear);
    ASSERT_NE(table.segments(), nullptr);
    for (std::size_t code = 0; code < 256; ++code) {
      EXPECT_NEAR(table[code], c.linear[code], kMaxSegmentError) << "code " << code;
      EXPECT_EQ(table[code], table.segments()->value(code)) << "code " << code;
    }
  }
}

TEST(CodeTable, ErrorsOfNeighbouringCodesCompensateEachOther) {
  // A segment's base is an integer, so that its mean error is up to half a unit.
  for (const Curve& c : camera_curves()) {
    SCOPED_TRACE(c.name);
    const CodeTable table(c.linear);
    for (std::size_t from = 0; from + 64 <= 256; from += 16) {
      double sum = 0;
      for (std::size_t code = from; code < from + 64; ++code) sum += table[code] - c.linear[code];
      EXPECT_NEAR(sum / 64, 0, 0.5) << "codes from " << from;
    }
  }
}

TEST(CodeTable, KeepsEachValueOfACurveThatQuadraticsDoNotRepresent) {
  // Eleven straight pieces: nine kinks within segments.
  const auto pieces = [](double v) {
    const double at = 11 * v, first = std::floor(at);
    const auto knot = [](double k) { return std::pow(k / 11, 2.2); };
    return knot(first) + (at - first) * (knot(first + 1) - knot(first));
  };
  const auto alternating = [](double v) { return std::lround(255 * v) % 2 == 0 ? 0.0 : 1.0; };
  for (const Curve& c : {curve("pieces", pieces), curve("alternating", alternating)}) {
    SCOPED_TRACE(c.name);
    const CodeTable table(c.linear);
    EXPECT_EQ(table.segments(), nullptr);
    for (std::size_t code = 0; code < 256; ++code) EXPECT_NEAR(table[code], c.linear[code], 1) << "code " << code;
  }
}

TEST(CodeTable, ClampsValuesBeyondFullScale) {
  std::array<double, 256> linear{};
  for (std::size_t i = 0; i < 256; ++i) linear[i] = 600.0 * (static_cast<double>(i) - 100);
  const CodeTable table(linear);
  EXPECT_EQ(table[0], 0);
  EXPECT_EQ(table[255], 65535);
  EXPECT_NEAR(table[150], 30000, kMaxSegmentError);
}

}  // namespace
}  // namespace lightwell::estimate
