#include <gtest/gtest.h>

#include <lightwell/json.hpp>

namespace lightwell {
namespace {

TEST(JsonString, QuotesAndEscapes) {
  EXPECT_EQ(json_string(""), R"("")");
  EXPECT_EQ(json_string("a\"b\\c\n\x1f"), R"("a\"b\\c\u000a\u001f")");
  EXPECT_EQ(json_string(std::string_view("a\0b", 3)), R"("a\u0000b")");
}

TEST(JsonString, KeepsUtf8) { EXPECT_EQ(json_string("Büro \u4E2D"), "\"Büro \u4E2D\""); }

TEST(JsonString, EscapesControlCharactersAndInvalidUtf8) {
  EXPECT_EQ(json_string("\x1b[2J\x7f\xC2\x9B\u202E"), R"("\u001b[2J\u007f\u009b\u202e")");
  EXPECT_EQ(json_string("a\xFF\xE2\x82"), R"("a\ufffd\ufffd\ufffd")");
}

}  // namespace
}  // namespace lightwell
