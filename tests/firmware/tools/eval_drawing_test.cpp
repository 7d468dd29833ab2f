// Label placement without overlaps; charts as SVG and PNG.
#include <cmath>
#include <fstream>
#include <iterator>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "imaging/image_file.hpp"
#include "support/temp_dir.hpp"
#include "tools/lightwell_eval/labels.hpp"

namespace lightwell::eval {
namespace {

using ::testing::HasSubstr;

bool overlap(const Box& a, const Box& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

TEST(Labels, DoNotOverlapWhenPointsAreDense) {
  std::mt19937 random(3);
  std::normal_distribution<double> x(500, 90), y(300, 60);
  std::vector<Label> labels;
  for (int i = 0; i < 40; ++i) labels.push_back({{"label " + std::to_string(i)}, {x(random), y(random)}});
  const Box room{0, 0, 1000, 600};
  const std::vector<LabelPlacement> placed = place_labels(labels, room, {});
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const Box& a = placed[i].box;
    EXPECT_TRUE(a.x >= 0 && a.y >= 0 && a.x + a.width <= 1000 && a.y + a.height <= 600) << i;
    for (std::size_t k = 0; k < i; ++k) EXPECT_FALSE(overlap(a, placed[k].box)) << i << " and " << k;
  }
}

TEST(Labels, ArePlacedNextToAnIsolatedPoint) {
  const std::vector<Label> one = {{{"alone"}, {100, 100}}};
  const LabelPlacement p = place_labels(one, {0, 0, 200, 200}, {}).front();
  EXPECT_LT(std::hypot(p.leader_end.x - 100, p.leader_end.y - 100), 15);
}

TEST(Drawing, WritesSvgAndPng) {
  Chart chart{200, 100, {}, {}, {}};
  chart.strokes.push_back({{{10, 10}, {190, 90}}, {0, 0, 0}, 2, true});
  chart.marks.push_back({{50, 50}, 5, {200, 0, 0}, true, false});
  chart.texts.push_back({"a < b & c", {60, 50}, 14, {0, 0, 0}});
  chart.texts.push_back({"upwards", {20, 60}, 12, {0, 0, 0}, Anchor::middle, false, true});
  const test::TempDir folder;
  ASSERT_TRUE(write_svg(chart, folder.path("a.svg")).ok());
  ASSERT_TRUE(write_png(chart, folder.path("a.png")).ok());
  std::ifstream file(folder.path("a.svg"));
  const std::string svg{std::istreambuf_iterator<char>(file), {}};
  EXPECT_THAT(svg, HasSubstr("a &lt; b &amp; c"));
  EXPECT_THAT(svg, HasSubstr("</svg>"));
  const Result<Image> png = read_image(folder.path("a.png"));
  ASSERT_TRUE(png.ok()) << png.status().message();
  EXPECT_EQ(png->width, 400);
  EXPECT_EQ(png->height, 200);
}

TEST(Drawing, WriteErrorsAreReturnedAsStatus) {
  EXPECT_FALSE(write_svg({20, 20, {}, {}, {}}, "/nonexistent/a.svg").ok());
  EXPECT_FALSE(write_png({20, 20, {}, {}, {}}, "/nonexistent/a.png").ok());
}

}  // namespace
}  // namespace lightwell::eval
