// One line of JSON (RFC 8259), written key by key.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include <lightwell/json.hpp>

namespace lightwell::tool {

/// A number as JSON; infinity and NaN, which JSON cannot represent, become null.
[[nodiscard]] std::string json_number(double value);

/// An object; keys keep the order of insertion.
class JsonLine {
 public:
  JsonLine& number(std::string_view key, double value) { return raw(key, json_number(value)); }
  JsonLine& text(std::string_view key, std::string_view value) { return raw(key, json_string(value)); }
  JsonLine& numbers(std::string_view key, std::span<const float> values);
  JsonLine& texts(std::string_view key, std::span<const std::string_view> values);
  /// `json` must be valid JSON.
  JsonLine& raw(std::string_view key, std::string_view json);

  [[nodiscard]] std::string str() const { return "{" + body_ + "}"; }

 private:
  std::string body_;
};

}  // namespace lightwell::tool
