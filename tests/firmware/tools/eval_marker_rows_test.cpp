// Rows of a marker: input and its errors, Pareto front, table, JSON and its chart.
#include <string>
#include <utility>
#include <vector>

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

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kDefault =
    R"({"what": "default", "knob": "setting", "width": 640, "height": 480, "ms": 10, "ms_first": 60.5,)"
    R"( "memcpy_ratio": 91, "rms": 0.03, "worst_rms": 0.25, "direction_deg": 0.4,)"
    R"( "worst_direction_deg": 2.5, "flagged": 0.05, "unanswered": 0})";
constexpr const char* kNoLamps =
    R"({"what":"0 lamps","knob":"order","width":640,"height":480,"ms":7e0,"ms_first":1.0E1,)"
    R"("memcpy_ratio":66,"rms":0.16,"worst_rms":0.33,"direction_deg":null,)"
    R"("worst_direction_deg":null,"flagged":1,"unanswered":0})";

Result<std::vector<MarkerRow>> read(const std::string& text) {
  const test::TempDir folder;
  folder.write("rows.jsonl", text);
  return read_marker_rows(folder.path("rows.jsonl"));
}

std::string with(std::string line, const std::string& part, const std::string& instead) {
  return line.replace(line.find(part), part.size(), instead);
}

MarkerRow row(const std::string& what, double ms, double rms, const std::string& parameter = "faces") {
  MarkerRow r;
  r.what = what;
  r.parameter = parameter;
  r.width = 640;
  r.height = 480;
  r.ms = ms;
  r.rms = rms;
  return r;
}

TEST(MarkerRows, AreReadWithAllFields) {
  const auto rows = read(std::string(kDefault) + "\n\n" + kNoLamps + "\r\n");
  ASSERT_TRUE(rows) << rows.status().message();
  ASSERT_EQ(rows->size(), 2U);
  const MarkerRow &default_row = rows->at(0), &none = rows->at(1);
  EXPECT_EQ(default_row.what, "default");
  EXPECT_EQ(default_row.parameter, "setting");
  EXPECT_EQ(default_row.width, 640);
  EXPECT_EQ(default_row.height, 480);
  EXPECT_EQ(default_row.ms, 10);
  EXPECT_EQ(default_row.ms_first, 60.5);
  EXPECT_EQ(default_row.memcpy_ratio, 91);
  EXPECT_EQ(default_row.rms, 0.03);
  EXPECT_EQ(default_row.worst_rms, 0.25);
  EXPECT_EQ(default_row.direction_deg, 0.4);
  EXPECT_EQ(default_row.worst_direction_deg, 2.5);
  EXPECT_EQ(default_row.flagged, 0.05);
  EXPECT_EQ(default_row.unanswered, 0);
  EXPECT_EQ(none.parameter, "order");
  EXPECT_EQ(none.ms, 7);
  EXPECT_EQ(none.ms_first, 10);
  EXPECT_FALSE(none.direction_deg) << "without lamps there is no direction";
}

TEST(MarkerRows, ErrorsNameFileAndLine) {
  const std::string good = std::string(kDefault) + "\n", other = kNoLamps;
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"hello", "invalid literal"},
      {"[]", "not a JSON object"},
      {other.substr(0, 40), "unexpected end of input"},
      {other + " {}", "expected end of input"},
      {with(other, "\"ms\":7e0", "\"ms\":\"7\""), "\"ms\" is not a number"},
      {with(other, "\"ms\":7e0", "\"ms\":nan"), "invalid literal"},
      {with(other, "\"ms\":7e0", "\"ms\":-7"), "\"ms\" is negative"},
      {with(other, "\"ms\":7e0", "\"ms\":0"), "\"ms\" must be above 0"},
      {with(other, "\"ms\":7e0", "\"ms\":7,\"ms\":7"), "\"ms\" is there twice"},
      {with(other, "\"ms\":7e0,", ""), "lacks \"ms\""},
      {with(other, "\"ms\":7e0", "\"ms\":7,\"bytes\":1"), "\"bytes\" is not a field"},
      {with(other, "order", "colour"), "no knob 'colour'"},
      {with(other, "\"flagged\":1", "\"flagged\":1.5"), "\"flagged\" must be a number of at most 1"},
      {with(other, "640", "320"), "pictures of 320x480 beside those of 640x480"},
      {with(other, "640", "640.5"), "whole number of pixels"},
      {good, "a case of the name 'default' came before"},
  };
  for (const auto& [line, why] : wrong) {
    const auto rows = read(good + line + "\n");
    ASSERT_FALSE(rows) << line;
    EXPECT_EQ(rows.status().code(), StatusCode::data_loss) << line;
    EXPECT_THAT(rows.status().message(), AllOf(HasSubstr("rows.jsonl:2: "), HasSubstr(why))) << line;
  }
  EXPECT_THAT(read("\n").status().message(), HasSubstr("no rows"));
  EXPECT_EQ(read_marker_rows("/nonexistent/rows").status().code(), StatusCode::not_found);
}

TEST(MarkerFront, HasTheNonDominatedRows) {
  std::vector<MarkerRow> rows = {row("quick", 5, 0.05), row("fine", 10, 0.02), row("slower and worse", 11, 0.03),
                                 row("nowhere", 1, 0.01)};
  rows[3].rms.reset();
  mark_front(rows);
  EXPECT_TRUE(rows[0].on_front && rows[1].on_front);
  EXPECT_FALSE(rows[2].on_front);
  EXPECT_FALSE(rows[3].on_front) << "no frame was answered";
}

TEST(MarkerFront, IgnoresSmallDifferences) {
  std::vector<MarkerRow> rows = {row("a", 10, 0.0300), row("b", 10.4, 0.0304)};
  mark_front(rows);
  EXPECT_TRUE(rows[0].on_front && rows[1].on_front);
  rows[1].rms = 0.031;
  mark_front(rows);
  EXPECT_FALSE(rows[1].on_front);
}

TEST(MarkerFront, WorstErrorAndFlaggedShareAreObjectives) {
  std::vector<MarkerRow> rows = {row("steady", 10, 0.03), row("wild", 5, 0.02), row("shy", 5, 0.02)};
  rows[0].worst_rms = 0.1, rows[1].worst_rms = 4, rows[2].worst_rms = 0.1;
  rows[2].flagged = 0.3;
  mark_front(rows);
  EXPECT_TRUE(rows[0].on_front && rows[2].on_front);
  EXPECT_TRUE(rows[1].on_front) << "no frame of it is flagged";
  rows[1].flagged = 0.3;
  mark_front(rows);
  EXPECT_FALSE(rows[1].on_front);
}

TEST(MarkerTable, NamesTheRowsThatDominateTheDefault) {
  std::vector<MarkerRow> rows = {row("default", 10, 0.03, "setting"), row("4 faces", 12, 0.04)};
  mark_front(rows);
  EXPECT_THAT(marker_table_of(rows), AllOf(HasSubstr("| default"), HasSubstr("default: on the measured front")));
  rows[1].ms = 5, rows[1].rms = 0.02;
  mark_front(rows);
  EXPECT_THAT(marker_table_of(rows), HasSubstr("default: NOT on the measured front, dominated by 4 faces."));
  EXPECT_EQ(marker_table_of({}), "");
}

TEST(MarkerJson, IsAKeyOfTheJsonWithTheSameNumbers) {
  std::vector<MarkerRow> rows = {row("default", 10, 0.03, "setting")};
  mark_front(rows);
  const auto json = json_of({}, {{"city"}, 5, false}, rows);
  EXPECT_THAT(json["marker"].dump(),
              AllOf(HasSubstr(R"([{"what":"default","knob":"setting","width":640)"),
                    HasSubstr(R"("rms":0.03,"worst_rms":null)"), HasSubstr(R"("on_front":true,"beaten_by":[]})")));
  EXPECT_FALSE(json_of({}, {{"city"}, 5, false}).contains("marker"));
  rows.push_back(row("4 faces", 5, 0.02));
  mark_front(rows);
  EXPECT_THAT(json_of(rows).dump(), HasSubstr(R"("on_front":false,"beaten_by":["4 faces"]},)"));
}

TEST(MarkerChart, HasALabelForEachAnsweredCase) {
  std::vector<MarkerRow> rows = {row("default", 10, 0.03, "setting"), row("4 faces", 12, 0.04), row("1 face", 8, 0.1)};
  rows[2].rms.reset();
  const test::TempDir folder;
  const std::string json = json_text(json_of({}, {{"city"}, 5, false}, rows));
  const std::string svg = test::read_file(test::plotted(folder, json, "pareto.svg"));
  EXPECT_THAT(svg, AllOf(HasSubstr(">Light from a marker, one picture of 640x480, 8 bits<"), HasSubstr(">4 faces<"),
                         HasSubstr(">most faces<")));
  EXPECT_THAT(svg, Not(HasSubstr(">1 face<")));
  EXPECT_THAT(svg, Not(HasSubstr(">Error and time<"))) << "nothing but the marker was measured";
}

}  // namespace
}  // namespace lightwell::eval
