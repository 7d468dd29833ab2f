// A command's words on the command line, in their order: options with a value each, and files between them.
#pragma once

#include <array>
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

enum Exit : int { kDone = 0, kBadInput = 1, kUsage = 2 };

struct Word {
  std::string option;  ///< "--family"; empty for a file.
  std::string value;
};

/// "--name value" and "--name=value". An option that is not in `known` is refused with the nearest one that is. --help
/// (-h) has no value and ends the list.
[[nodiscard]] Result<std::vector<Word>> words_of(std::span<char* const> arguments,
                                                 const std::vector<std::string_view>& known);

template <class T>
[[nodiscard]] std::optional<T> number(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "1,2.5,-3": `count` finite numbers.
[[nodiscard]] std::optional<std::vector<double>> numbers(std::string_view text, std::size_t count);

/// "-" is standard output.
[[nodiscard]] Status write_file(const std::string& path, std::string_view bytes);

/// The shortest text that reads back as the same number, as JSON has it: "Infinity" and "NaN" in quotes, as protobuf's.
[[nodiscard]] std::string json_number(double value);
[[nodiscard]] std::string json_string(std::string_view text);

}  // namespace lightwell::calibrate
