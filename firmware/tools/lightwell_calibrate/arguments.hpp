// A command's words on the command line, in their order: options with a value each, and files between them.
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

/// What every subcommand ends with.
enum Exit : int { kDone = 0, kBadInput = 1, kUsage = 2 };

struct Argument {
  std::string option;  ///< "--family"; empty for a file.
  std::string value;
};

/// "--name value" and "--name=value"; those in `flags` stand alone. An option that is in neither is refused with the
/// nearest one that is. --help (-h) has no value and ends the list.
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

/// "1,2.5,-3": `count` finite numbers.
[[nodiscard]] std::optional<std::vector<double>> numbers(std::string_view text, std::size_t count);

}  // namespace lightwell::calibrate
