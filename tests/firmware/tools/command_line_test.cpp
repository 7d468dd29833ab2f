#include "tools/command_line.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lightwell {
namespace {

using testing::HasSubstr;

enum class Color { red, green };
constexpr Color kColors[] = {Color::red, Color::green};
std::string_view to_string(Color color) { return color == Color::red ? "red" : "green"; }

Result<int> parse_even(const std::string& text) {
  const int number = std::stoi(text);
  if (number % 2 == 0) return number;
  return Status(StatusCode::invalid_argument, "'" + text + "' is odd");
}

struct Tool {
  CLI::App app{"Draws.", "draw"};
  double width = 1;
  Color color = Color::red;
  int even = 0;
  std::vector<int> lens;
  std::vector<std::string> files;
  const CLI::Option *lens_option = nullptr, *file_option = nullptr;

  Tool() {
    app.add_option("--width", width)->check(number_where("above 0", [](double w) { return w > 0; }));
    add_named_option(app, "--color", color, kColors, "The color");
    add_parsed_option(app, "--even", even, parse_even, "An even number");
    lens_option = app.add_option("--lens", lens)->allow_extra_args(false);
    file_option = app.add_option("FILES", files);
  }

  /// Expects that the arguments are accepted.
  void accept(const std::vector<std::string>& arguments) {
    EXPECT_FALSE(parse_command_line(app, arguments)) << testing::PrintToString(arguments);
  }
};

/// The message about wrong usage.
std::string refused(const std::vector<std::string>& arguments) {
  Tool tool;
  testing::internal::CaptureStderr();
  EXPECT_EQ(parse_command_line(tool.app, arguments), kUsage) << testing::PrintToString(arguments);
  const std::string message = testing::internal::GetCapturedStderr();
  EXPECT_THAT(message, testing::StartsWith("draw: "));
  EXPECT_THAT(message, testing::EndsWith("; see --help\n"));
  return message;
}

TEST(CommandLine, SetsValues) {
  Tool tool;
  tool.accept({"--width=2.5", "--color", "green", "--even", "-4"});
  EXPECT_EQ(tool.width, 2.5);
  EXPECT_EQ(tool.color, Color::green);
  EXPECT_EQ(tool.even, -4);
}

TEST(CommandLine, KeepsTheOrderOfOptionsAndFiles) {
  Tool tool;
  tool.accept({"a.png", "--lens", "1", "b.png", "c.png", "--lens=0"});
  EXPECT_EQ(tool.lens, (std::vector{1, 0}));
  EXPECT_EQ(tool.files, (std::vector<std::string>{"a.png", "b.png", "c.png"}));
  using Places = std::vector<std::pair<const CLI::Option*, std::size_t>>;
  EXPECT_EQ(in_order(tool.app), (Places{{tool.file_option, 0},
                                        {tool.lens_option, 0},
                                        {tool.file_option, 1},
                                        {tool.file_option, 2},
                                        {tool.lens_option, 1}}));
}

TEST(CommandLine, ErrorsNameTheArgumentAndTheRemedy) {
  EXPECT_THAT(refused({"--widht", "2"}), HasSubstr("unknown option --widht; did you mean --width?"));
  EXPECT_THAT(refused({"--widht=2", "--even", "3"}), HasSubstr("unknown option --widht"));
  EXPECT_THAT(refused({"--width"}), HasSubstr("--width"));
  for (const char* width : {"0", "-1", "nan", "inf", "wide", "1e999"})
    EXPECT_THAT(refused({"--width", width}), HasSubstr("'" + std::string(width) + "' is not above 0"));
  EXPECT_THAT(refused({"--color", "blue"}), HasSubstr("--color: 'blue' is not known; known are: red green"));
  EXPECT_THAT(refused({"--even", "3"}), HasSubstr("--even: '3' is odd"));
}

TEST(CommandLine, SuggestsASubcommand) {
  CLI::App app{"Draws.", "draw"};
  app.require_subcommand(1);
  app.add_subcommand("circle");
  testing::internal::CaptureStderr();
  EXPECT_EQ(parse_command_line(app, {"cirle"}), kUsage);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "draw: unexpected argument 'cirle'; did you mean circle?; see --help\n");
}

TEST(CommandLine, HelpGoesToStandardOutput) {
  Tool tool;
  testing::internal::CaptureStdout();
  EXPECT_EQ(parse_command_line(tool.app, {"--help"}), kDone);
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("--width"));
}

}  // namespace
}  // namespace lightwell
