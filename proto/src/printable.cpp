#include <array>
#include <cstdio>

#include <lightwell/json.hpp>
#include <lightwell/printable.hpp>

namespace lightwell {
namespace {

/// Length in bytes of the UTF-8 character (RFC 3629) that begins here; 0 if there is none.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(text[i])); };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xC2 && first < 0xE0   ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  if (length == 0 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
  // Overlong forms, surrogates, and code points above U+10FFFF.
  if ((first == 0xE0 && byte(1) < 0xA0) || (first == 0xED && byte(1) >= 0xA0)) return 0;
  if ((first == 0xF0 && byte(1) < 0x90) || (first == 0xF4 && byte(1) >= 0x90)) return 0;
  return length;
}

/// Control characters (C0, C1, DEL), which a terminal executes, and bidirectional controls, which can disguise a name.
bool is_control(std::string_view character) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(character[i]); };
  if (character.size() == 1) return byte(0) < 0x20 || byte(0) == 0x7F;
  if (character.size() == 2) return (byte(0) == 0xC2 && byte(1) < 0xA0) || (byte(0) == 0xD8 && byte(1) == 0x9C);
  if (character.size() == 3 && byte(0) == 0xE2)
    return (byte(1) == 0x80 && (byte(2) == 0x8E || byte(2) == 0x8F || (byte(2) >= 0xA8 && byte(2) <= 0xAE))) ||
           (byte(1) == 0x81 && byte(2) >= 0xA6 && byte(2) <= 0xA9);
  return false;
}

/// Passes each character to `keep`, or to `escape` if it must be escaped or is a byte that is not UTF-8.
template <class Keep, class Escape>
void each_character(std::string_view text, Keep keep, Escape escape) {
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const std::string_view character = text.substr(0, length == 0 ? 1 : length);
    length != 0 && !is_control(character) ? keep(character) : escape(character, length != 0);
    text.remove_prefix(character.size());
  }
}

std::string formatted(const char* format, unsigned value) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

/// Code point of a valid character of up to three bytes.
unsigned code_point(std::string_view character) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(character[i])); };
  if (character.size() == 1) return byte(0);
  if (character.size() == 2) return (byte(0) & 0x1FU) << 6U | (byte(1) & 0x3FU);
  return (byte(0) & 0x0FU) << 12U | (byte(1) & 0x3FU) << 6U | (byte(2) & 0x3FU);
}

}  // namespace

std::string printable(std::string_view text) {
  std::string out;
  each_character(
      text, [&](std::string_view character) { out += character; },
      [&](std::string_view character, bool) {
        for (const char c : character) out += formatted("\\x%02x", static_cast<unsigned char>(c));
      });
  return out;
}

std::string json_string(std::string_view text) {
  std::string out = "\"";
  each_character(
      text,
      [&](std::string_view character) {
        if (character == "\"" || character == "\\") out += '\\';
        out += character;
      },
      [&](std::string_view character, bool whole) {
        out += formatted("\\u%04x", whole ? code_point(character) : 0xFFFD);
      });
  return out + '"';
}

}  // namespace lightwell
