// Numbers and fields in text; escaping of untrusted text for a terminal or a log.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

namespace lightwell {

/// Parses N numbers separated by commas, for example "1,2.5,-3". nullopt for anything else, also for white space, a
/// plus sign, a number out of the type's range, NaN and infinity.
template <class T, std::size_t N>
[[nodiscard]] std::optional<std::array<T, N>> parse_numbers(std::string_view text) {
  std::array<T, N> out{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < N; ++i) {
    const auto [stop, error] = std::from_chars(at, end, out[i]);
    if (error != std::errc() || (i + 1 < N ? stop == end || *stop != ',' : stop != end)) return std::nullopt;
    if constexpr (std::is_floating_point_v<T>)
      if (!std::isfinite(out[i])) return std::nullopt;
    at = i + 1 < N ? stop + 1 : stop;
  }
  return out;
}

/// Parses one number, in the same way.
template <class T>
[[nodiscard]] std::optional<T> parse_number(std::string_view text) {
  const auto numbers = parse_numbers<T, 1>(text);
  return numbers ? std::optional<T>(numbers->front()) : std::nullopt;
}

/// Without spaces, tabs and carriage returns at both ends.
[[nodiscard]] std::string_view trimmed(std::string_view text);
/// The trimmed fields between the commas of a line; one empty field for an empty line.
[[nodiscard]] std::vector<std::string_view> comma_separated(std::string_view line);

/// The parts with ", " between them.
template <class Parts>
[[nodiscard]] std::string joined(const Parts& parts) {
  std::string out;
  for (const auto& part : parts) out.append(out.empty() ? "" : ", ").append(part);
  return out;
}

/// At most `max_bytes` bytes of the text, cut between UTF-8 characters.
[[nodiscard]] std::string truncated(std::string text, std::size_t max_bytes);

/// Number of insertions, deletions and substitutions of one character that turn `a` into `b` (Levenshtein 1966).
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

/// As printf, of any length.
[[gnu::format(printf, 1, 2)]] [[nodiscard]] std::string formatted(const char* format, ...);

/// Escapes as \xNN: control characters (C0, C1, DEL, line and paragraph separators), bidirectional control characters
/// (which can disguise a name as another), and bytes that are not UTF-8. Use it for all text from a network, a file or
/// another user before printing or logging: line breaks could forge log lines, escape sequences control the terminal.
[[nodiscard]] std::string printable(std::string_view text);

}  // namespace lightwell
