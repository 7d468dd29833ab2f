#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tools/command_line.hpp"

namespace lightwell {
namespace {

TEST(JsonText, IsOneLineWithTheKeysInTheirOrder) {
  EXPECT_EQ(json_text({{"z", 1}, {"a", {{"x", true}, {"b", nullptr}}}, {"list", {1, 2.5, "three"}}}),
            R"({"z":1,"a":{"x":true,"b":null},"list":[1,2.5,"three"]})");
}

TEST(JsonText, NumbersKeepTheirValue) {
  for (const double value : {0.1, 1e-300, 2.0 / 3, -123456789.123456789, 5e-324})
    EXPECT_EQ(nlohmann::json::parse(json_text(value)).get<double>(), value);
  EXPECT_EQ(json_text(7), "7");
  EXPECT_EQ(json_text(std::numeric_limits<std::uint64_t>::max()), "18446744073709551615");
  EXPECT_EQ(json_text(std::numeric_limits<double>::infinity()), "null");
  EXPECT_EQ(json_text(std::numeric_limits<double>::quiet_NaN()), "null");
  EXPECT_EQ(json_text(json_or_null(std::nullopt)), "null");
  EXPECT_EQ(json_text(json_or_null(0.5)), "0.5");
}

TEST(JsonText, QuotesAndEscapes) {
  EXPECT_EQ(json_text("a\"b\\c\n\x1f"), R"("a\"b\\c\n\u001f")");
  EXPECT_EQ(json_text(std::string("a\0b", 3)), R"("a\u0000b")");
  EXPECT_EQ(nlohmann::json::parse(json_text("Büro \u4E2D")).get<std::string>(), "Büro \u4E2D");
}

TEST(JsonText, EscapesControlCharactersAndReplacesInvalidUtf8) {
  EXPECT_EQ(json_text("\x1b[2J\x7f\xC2\x9B\u202E"), R"("\u001b[2J\u007f\u009b\u202e")");
  EXPECT_EQ(json_text("a\xFF\xE2\x82"), R"("a\ufffd\ufffd")");
  nlohmann::ordered_json object;
  object["\xFF"] = "\xE2\x82x";
  EXPECT_EQ(json_text(object), R"({"\ufffd":"\ufffdx"})");
}

}  // namespace
}  // namespace lightwell
