// Damaged messages, for tests that compare what readers accept.
#pragma once

#include <cstddef>
#include <random>
#include <string>
#include <vector>

#include <lightwell/text.hpp>

namespace lightwell::test {

inline std::string hex_of(const std::string& bytes) {
  std::string out;
  for (const char c : bytes) out += formatted("%02x", static_cast<unsigned>(static_cast<unsigned char>(c)));
  return out;
}

/// One fault, or one unusual but valid encoding: a repeated field, an unknown field.
inline std::string mutated(std::string bytes, const std::string& other, std::mt19937& random) {
  const auto below = [&](std::size_t n) { return n == 0 ? 0 : std::size_t{random()} % n; };
  const auto any_byte = [&] { return static_cast<char>(random() & 255U); };
  switch (below(9)) {
    case 0:
      bytes[below(bytes.size())] = any_byte();
      break;
    case 1:
      bytes[below(bytes.size())] ^= static_cast<char>(1U << below(8));
      break;
    case 2:
      bytes.resize(below(bytes.size()));
      break;
    case 3:
      bytes.insert(below(bytes.size()), 1, any_byte());
      break;
    case 4:
      bytes.erase(below(bytes.size()), 1 + below(3));
      break;
    case 5:
      bytes += bytes.substr(below(bytes.size()), below(40));
      break;
    case 6:
      bytes += other;
      break;  // Two concatenated messages: protobuf merges them.
    case 7:
      bytes += std::string("\xA3\x06\x08\x01\x1B\x10\x07\x1C\xA4\x06", 10);
      break;  // A group in a group.
    default:
      for (int k = 0; k < 3; ++k) bytes[below(bytes.size())] = any_byte();
  }
  return bytes;
}

/// Nested groups with the number 100.
inline std::string nested_groups(std::size_t depth) {
  std::string bytes;
  for (std::size_t k = 0; k < depth; ++k) bytes += "\xA3\x06";
  for (std::size_t k = 0; k < depth; ++k) bytes += "\xA4\x06";
  return bytes;
}

/// Messages with groups nested up to the limit of readers and deeper, at the top level and in the nested message of the
/// field `number`.
inline std::vector<std::string> nested_mutants(const std::string& message, int number) {
  const char tag = static_cast<char>(number * 8 + 2);
  std::vector<std::string> mutants;
  for (const std::size_t depth : {1, 60, 62, 63, 98, 99, 100, 101, 102, 1000}) {
    mutants.push_back(message + nested_groups(depth));
    const std::string inner = nested_groups(depth);
    std::string length;
    std::size_t rest = inner.size();
    for (; rest >= 128; rest >>= 7) length += static_cast<char>(rest % 128 + 128);
    mutants.push_back(message + tag + length + static_cast<char>(rest) + inner);
  }
  return mutants;
}

}  // namespace lightwell::test
