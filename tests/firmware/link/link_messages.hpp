// Bytes in place of what the publisher encodes, for tests of links.
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "link/link.hpp"

namespace lightwell::test {

/// Bytes in place of an encoded descriptor: the number as text, padded to the given length.
[[nodiscard]] inline EncodedDescriptor message(int number, std::size_t bytes = 16) {
  std::string text = std::to_string(number);
  text.resize(std::max(bytes, text.size()), '.');
  const auto raw = std::as_bytes(std::span(text));
  return std::make_shared<const std::vector<std::byte>>(raw.begin(), raw.end());
}
[[nodiscard]] inline std::string text_of(const EncodedDescriptor& descriptor) {
  return {reinterpret_cast<const char*>(descriptor->data()), descriptor->size()};
}

/// In place of an update of a plane: messages "changeN.0", "wholeN.0" and so on, padded with spaces to `bytes`.
[[nodiscard]] inline std::shared_ptr<const EncodedPlane> plane_update(int number, std::size_t changes,
                                                                      std::size_t whole, std::size_t bytes = 16) {
  auto out = std::make_shared<EncodedPlane>();
  const auto text = [&](const char* kind, std::size_t k) {
    std::string name = kind + std::to_string(number) + "." + std::to_string(k);
    name.resize(bytes, ' ');
    const auto raw = std::as_bytes(std::span(name));
    return std::vector<std::byte>(raw.begin(), raw.end());
  };
  for (std::size_t k = 0; k < changes; ++k) out->changes.push_back(text("change", k));
  for (std::size_t k = 0; k < whole; ++k) out->whole.push_back(text("whole", k));
  return out;
}
/// The name of such a message; "nothing" without one.
template <class OptionalText>
[[nodiscard]] std::string plane_message_name(const OptionalText& text) {
  return text ? text->substr(0, text->find(' ')) : "nothing";
}

}  // namespace lightwell::test
