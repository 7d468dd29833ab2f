#include <cstdint>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "host_sdk/tools/lightwell/common.hpp"

namespace lightwell::tool {
namespace {

TEST(JsonText, IsSafeToPrintAndReplacesInvalidUtf8) {
  EXPECT_EQ(json_text("a\"b\\c\n\x1b[2J\x7f\xC2\x9B\u202E"), R"("a\"b\\c\n\u001b[2J\u007f\u009b\u202e")");
  EXPECT_EQ(json_text("a\xFF\xE2\x82"), R"("a\ufffd\ufffd")");
}

TEST(JsonText, KeepsNumbers) {
  EXPECT_EQ(json_text(std::numeric_limits<std::uint64_t>::max()), "18446744073709551615");
  EXPECT_EQ(nlohmann::json::parse(json_text(2.0 / 3)).get<double>(), 2.0 / 3);
  EXPECT_EQ(json_text(std::numeric_limits<double>::infinity()), "null");
}

}  // namespace
}  // namespace lightwell::tool
