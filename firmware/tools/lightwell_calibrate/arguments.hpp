// Command-line arguments in their order: options with values, flags, and files between them.
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell::calibrate {

/// Exit status of all subcommands.
enum Exit : int { kDone = 0, kBadInput = 1, kUsage = 2 };

struct Argument {
  std::string option;  ///< "--family"; empty for a file.
  std::string value;
};

/// Parses "--name value" and "--name=value"; options in `flags` have no value. --help (-h) has no value and ends the
/// list. invalid_argument: an option that is in neither list (the message suggests the nearest one), a missing value.
[[nodiscard]] Result<std::vector<Argument>> parse_arguments(std::span<char* const> arguments,
                                                            const std::vector<std::string_view>& known,
                                                            const std::vector<std::string_view>& flags);

template <class T>
[[nodiscard]] std::optional<T> number(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Parses `count` finite numbers separated by commas, for example "1,2.5,-3".
[[nodiscard]] std::optional<std::vector<double>> numbers(std::string_view text, std::size_t count);

}  // namespace lightwell::calibrate
