#include <array>
#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/text.hpp>

namespace lightwell {
namespace {

using ::testing::ElementsAre;

TEST(ParseNumber, ReadsTheWholeText) {
  EXPECT_EQ(parse_number<int>("-12"), -12);
  EXPECT_EQ(parse_number<double>("2.5e-3"), 2.5e-3);
  for (const char* text : {"", " 1", "1 ", "+1", "1x", "1,2", "0x10", "nan", "inf", "1e999"})
    EXPECT_FALSE(parse_number<double>(text)) << text;
  for (const char* text : {"", "1.5", "99999999999", "-"}) EXPECT_FALSE(parse_number<int>(text)) << text;
  EXPECT_FALSE(parse_number<std::uint8_t>("256"));
}

TEST(ParseNumbers, NeedsAsManyAsAsked) {
  EXPECT_EQ((parse_numbers<double, 3>("1,2.5,-3")), (std::array{1.0, 2.5, -3.0}));
  for (const char* text : {"1,2", "1,2,3,4", "1,2,", ",1,2", "1,,2", "1,2, 3"})
    EXPECT_FALSE((parse_numbers<double, 3>(text))) << text;
}

TEST(Trimmed, RemovesBlanksAtBothEnds) {
  EXPECT_EQ(trimmed(" \ta b\r"), "a b");
  EXPECT_EQ(trimmed(" \t\r"), "");
  EXPECT_EQ(trimmed(""), "");
}

TEST(CommaSeparated, KeepsEmptyFields) {
  EXPECT_THAT(comma_separated("a, b c ,,d\r"), ElementsAre("a", "b c", "", "d"));
  EXPECT_THAT(comma_separated("a,"), ElementsAre("a", ""));
  EXPECT_THAT(comma_separated(""), ElementsAre(""));
}

TEST(Joined, HasCommasBetweenTheParts) {
  EXPECT_EQ(joined(std::vector<std::string>{"a", "b", "c"}), "a, b, c");
  EXPECT_EQ(joined(std::array<std::string_view, 1>{"a"}), "a");
  EXPECT_EQ(joined(std::vector<std::string>{}), "");
}

TEST(EditDistance, CountsEditsOfOneCharacter) {
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
  EXPECT_EQ(edit_distance("", "abc"), 3U);
  EXPECT_EQ(edit_distance("abc", "abc"), 0U);
}

TEST(Formatted, HasAnyLength) {
  EXPECT_EQ(formatted("%d %s %.2f", 7, "a", 0.125), "7 a 0.12");
  EXPECT_EQ(formatted("%s", ""), "");
  const std::string long_text(1000, 'x');
  EXPECT_EQ(formatted("%s", long_text.c_str()), long_text);
}

}  // namespace
}  // namespace lightwell
