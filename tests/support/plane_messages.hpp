// Updates of captured planes whose messages tell what they are, for tests of links.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "link/link.hpp"

namespace lightwell::test {

/// Messages "change7.0", "change7.1", ... and "whole7.0", ... for number 7, filled with spaces to `bytes`.
inline std::shared_ptr<const EncodedPlane> plane_update(int number, std::size_t changes, std::size_t whole,
                                                        std::size_t bytes = 16) {
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

/// "change7.0" of such a message; "nothing" of null.
inline std::string plane_name(std::span<const std::byte> message) {
  const std::string text(reinterpret_cast<const char*>(message.data()), message.size());
  return text.substr(0, text.find(' '));
}
inline std::string plane_name(const EncodedMessage& message) { return message ? plane_name(*message) : "nothing"; }

}  // namespace lightwell::test
