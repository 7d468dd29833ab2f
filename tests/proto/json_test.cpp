#include <gtest/gtest.h>

#include <lightwell/json.hpp>

namespace lightwell {
namespace {

TEST(JsonString, IsQuotedAndWhatWouldEndOrBreakItIsEscaped) {
  EXPECT_EQ(json_string(""), R"("")");
  EXPECT_EQ(json_string("a\"b\\c\n\x1f"), R"("a\"b\\c\u000a\u001f")");
  EXPECT_EQ(json_string(std::string_view("a\0b", 3)), R"("a\u0000b")");
}

TEST(JsonString, Utf8IsLeftAsItIs) { EXPECT_EQ(json_string("Büro \x7f"), "\"Büro \x7f\""); }

}  // namespace
}  // namespace lightwell
