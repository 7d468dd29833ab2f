// Pareto front, summary and table of lightwell-eval.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "firmware/tools/plotted.hpp"
#include "support/read_file.hpp"
#include "support/temp_dir.hpp"
#include "tools/command_line.hpp"
#include "tools/lightwell_eval/table.hpp"

namespace lightwell::eval {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Row row(const std::string& label, double ms, double bytes, double rms, bool named = false) {
  Row r;
  r.setup.label = label;
  r.setup.named = named;
  Outcome o;
  o.seconds = 1e-3 * ms;
  o.bytes = bytes;
  o.rms = rms;
  o.light_deg = 0.1;
  r.scenes = {o};
  summarise(r, 1e-3);
  return r;
}

TEST(Front, HasTheNonDominatedRows) {
  std::vector<Row> rows = {row("quick", 1, 200, 0.02), row("fine", 4, 300, 0.005), row("beaten", 5, 400, 0.02)};
  mark_front(rows);
  EXPECT_TRUE(rows[0].on_front);
  EXPECT_TRUE(rows[1].on_front);
  EXPECT_FALSE(rows[2].on_front);
}

TEST(Front, IgnoresSmallDifferencesOfTime) {
  std::vector<Row> rows = {row("a", 1.00, 200, 0.01), row("b", 1.02, 200, 0.01)};
  mark_front(rows);
  EXPECT_TRUE(rows[0].on_front && rows[1].on_front);
}

TEST(Front, IgnoresTimeIfInstructionCountsAreEqual) {
  std::vector<Row> rows = {row("a", 1.0, 200, 0.01), row("b", 1.2, 200, 0.01)};
  rows[0].instructions_per_pixel = rows[1].instructions_per_pixel = 10;
  mark_front(rows);
  EXPECT_TRUE(rows[0].on_front && rows[1].on_front);
  rows[1].instructions_per_pixel = 12;
  mark_front(rows);
  EXPECT_FALSE(rows[1].on_front);
}

TEST(Front, WithoutACounterTheClockDecidesLessWhereAllResultsAreTheSame) {
  std::vector<Row> rows = {row("a", 1.0, 200, 0.01), row("b", 1.3, 200, 0.01)};
  mark_front(rows);
  EXPECT_TRUE(rows[0].on_front && rows[1].on_front);
  rows[1] = row("b", 1.3, 201, 0.01);
  mark_front(rows);
  EXPECT_FALSE(rows[1].on_front);
}

TEST(Front, CamerasDoNotCompete) {
  std::vector<Row> rows = {row("a", 1, 200, 0.01), row("b", 5, 300, 0.02)};
  rows[1].setup.width = 1280;
  mark_front(rows);
  EXPECT_TRUE(rows[1].on_front);
}

TEST(Front, FewerBytesAreAnObjective) {
  std::vector<Row> rows = {row("all of it", 1, 700, 0.001), row("one percent", 1.1, 180, 0.008)};
  mark_front(rows);
  EXPECT_TRUE(rows[0].on_front && rows[1].on_front);
  rows[0].bytes = 100;
  mark_front(rows);
  EXPECT_FALSE(rows[1].on_front);
}

TEST(Front, ATighterErrorBoundIsAnObjective) {
  std::vector<Row> rows = {row("vague", 1, 200, 0.01), row("sure", 2, 200, 0.01)};
  rows[0].bound = 0.05;
  rows[1].bound = 0.02;
  mark_front(rows);
  EXPECT_TRUE(rows[0].on_front && rows[1].on_front);
  rows[1].unbounded_share = 1;
  mark_front(rows);
  EXPECT_FALSE(rows[1].on_front) << "no bound counts as an infinite bound";
}

TEST(Front, EqualErrorForMoreTimeIsDominated) {
  std::vector<Row> rows = {row("coarse", 1, 200, 0.01), row("fine", 4, 200, 0.00995)};
  mark_front(rows);
  EXPECT_TRUE(rows[0].on_front);
  EXPECT_FALSE(rows[1].on_front);
}

TEST(Summary, HasMedianAndWorstOfTheScenes) {
  Row r = row("a", 1, 100, 0.01);
  for (const double more : {0.03, 0.02}) {
    r.scenes.push_back(r.scenes.front());
    r.scenes.back().rms = more;
  }
  r.scenes.back().light_deg.reset();
  summarise(r, 0.5e-3);
  EXPECT_DOUBLE_EQ(r.rms, 0.02);
  EXPECT_DOUBLE_EQ(r.worst_rms, 0.03);
  EXPECT_DOUBLE_EQ(r.memcpy_ratio, 2);
  ASSERT_TRUE(r.light_deg);
  EXPECT_FALSE(r.instructions_per_pixel);
}

TEST(Table, NamesTheSettingsThatAreOffTheFront) {
  std::vector<Row> rows = {row("fast", 1, 200, 0.01, true), row("exact", 9, 200, 0.01, true)};
  mark_front(rows);
  const std::string text = table_of(rows, {{"city"}, 5, false});
  EXPECT_THAT(text, HasSubstr("NOT on the measured front: exact."));
  rows.pop_back();
  EXPECT_THAT(table_of(rows, {{"city"}, 5, false}), Not(HasSubstr("NOT")));
}

TEST(Table, StatesThatInstructionCountsAreMissing) {
  const std::vector<Row> rows = {row("fast", 1, 200, 0.01, true)};
  EXPECT_THAT(table_of(rows, {{"city"}, 5, false}), HasSubstr("not available here"));
  const auto json = json_of(rows, {{"city"}, 5, false});
  EXPECT_TRUE(json["rows"][0]["outcomes"][0]["instructions_per_pixel"].is_null()) << json;
}

TEST(Chart, HasALabelForEachCase) {
  std::vector<Row> rows;
  for (const Case& c : all_cases()) {
    const auto n = static_cast<double>(rows.size());
    rows.push_back(row(c.label, 1 + n, 100 + 7 * n, 0.1 / (1 + n), c.named));
    rows.back().setup = c;
  }
  mark_front(rows);
  const test::TempDir folder;
  const std::string json = json_text(json_of(rows, {{"city", "night"}, 5, false}));
  const std::string svg = test::read_file(test::plotted(folder, json, "pareto.svg"));
  for (const Row& r : rows) EXPECT_THAT(svg, HasSubstr(">" + r.setup.label + "<"));
  for (const char* title : {"Error and time", "Error and size", "Through an 8-bit sensor", "2 scenes", "5.0 GB/s"})
    EXPECT_THAT(svg, HasSubstr(title));
}

TEST(Cases, HaveUniqueNamesAndValidConfigurations) {
  std::vector<std::string> names;
  for (const Case& c : all_cases()) {
    EXPECT_TRUE(c.config.validate().ok()) << c.label;
    EXPECT_THAT(names, Not(::testing::Contains(c.label)));
    names.push_back(c.label);
  }
}

}  // namespace
}  // namespace lightwell::eval
