// Bytes in place of what the publisher encodes, for tests of links.
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "link/link.hpp"
#include "support/plane_messages.hpp"

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

/// The name of a message of plane_update(); "nothing" without one.
template <class OptionalText>
[[nodiscard]] std::string plane_message_name(const OptionalText& text) {
  return text ? text->substr(0, text->find(' ')) : "nothing";
}

}  // namespace lightwell::test
