// One line of JSON (RFC 8259), written key by key.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include <lightwell/json.hpp>

namespace lightwell::tool {

/// A number as JSON; what JSON has no number for (infinity, NaN) becomes null.
[[nodiscard]] std::string json_number(double value);

/// An object; keys stand in the order in which they were put.
class JsonLine {
 public:
  JsonLine& number(std::string_view key, double value) { return raw(key, json_number(value)); }
  JsonLine& text(std::string_view key, std::string_view value) { return raw(key, json_string(value)); }
  JsonLine& numbers(std::string_view key, std::span<const float> values);
  JsonLine& texts(std::string_view key, std::span<const std::string_view> values);
  /// `json` is JSON already.
  JsonLine& raw(std::string_view key, std::string_view json);

  [[nodiscard]] std::string str() const { return "{" + body_ + "}"; }

 private:
  std::string body_;
};

}  // namespace lightwell::tool
