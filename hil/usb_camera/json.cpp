#include "usb_camera/json.hpp"

#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

namespace lightwell::usb_camera {

namespace {

class Reader {
 public:
  explicit Reader(std::string_view text) : text_(text) {}

  Result<JsonObject> object() {
    JsonObject out;
    if (!accept('{')) return stopped("'{'");
    if (!accept('}')) {
      do {
        skip_space();
        std::optional<std::string> name = text();
        if (!name) return stopped("a quoted name");
        if (!accept(':')) return stopped("':'");
        std::optional<JsonValue> read = value();
        if (!read) return stopped("a string, a number, true or false");
        out[std::move(*name)] = std::move(*read);
      } while (accept(','));
      if (!accept('}')) return stopped("',' or '}'");
    }
    skip_space();
    if (at_ != text_.size()) return stopped("the end");
    return out;
  }

 private:
  [[nodiscard]] Status stopped(const std::string& wanted) const {
    return {StatusCode::invalid_argument, "JSON: expected " + wanted + " at character " + std::to_string(at_ + 1)};
  }

  void skip_space() {
    while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos) ++at_;
  }

  bool accept(char c) {
    skip_space();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  bool accept_word(std::string_view word) {
    if (!text_.substr(at_).starts_with(word)) return false;
    at_ += word.size();
    return true;
  }

  std::optional<char> escaped() {
    constexpr std::string_view kNames = "\"\\/bfnrt", kMeanings = "\"\\/\b\f\n\r\t";
    if (at_ >= text_.size()) return std::nullopt;
    const char c = text_[at_++];
    if (const auto found = kNames.find(c); found != std::string_view::npos) return kMeanings[found];
    unsigned code = 0;
    const std::string_view digits = text_.substr(at_, 4);
    const auto [stop, error] = std::from_chars(digits.data(), digits.data() + digits.size(), code, 16);
    if (c != 'u' || error != std::errc() || stop != digits.data() + 4 || code >= 128) return std::nullopt;
    at_ += 4;
    return static_cast<char>(code);
  }

  std::optional<std::string> text() {
    if (at_ >= text_.size() || text_[at_] != '"') return std::nullopt;
    ++at_;
    std::string out;
    while (at_ < text_.size()) {
      const char c = text_[at_++];
      if (c == '"') return out;
      if (static_cast<unsigned char>(c) < 0x20) return std::nullopt;
      if (c != '\\') {
        out += c;
        continue;
      }
      const std::optional<char> meant = escaped();
      if (!meant) return std::nullopt;
      out += *meant;
    }
    return std::nullopt;
  }

  std::optional<JsonValue> value() {
    skip_space();
    if (accept_word("true")) return JsonValue(true);
    if (accept_word("false")) return JsonValue(false);
    if (std::optional<std::string> read = text()) return JsonValue(std::move(*read));
    double number = 0;
    const auto [stop, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), number);
    if (error != std::errc() || !std::isfinite(number)) return std::nullopt;
    at_ = static_cast<std::size_t>(stop - text_.data());
    return JsonValue(number);
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

Result<JsonObject> parse_json_object(std::string_view text) { return Reader(text).object(); }

}  // namespace lightwell::usb_camera
