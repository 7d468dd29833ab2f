#include "text_message.hpp"

#include <algorithm>
#include <utility>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/text_format.h>

#include "field_names.hpp"

namespace lightwell {
namespace {

namespace pb = google::protobuf;

/// Keeps the first error, because later ones are usually consequences of it.
struct FirstError final : pb::io::ErrorCollector {
  int line = -1, column = 0;  ///< From 0.
  std::string message;

  void AddError(int at_line, pb::io::ColumnNumber at_column, const std::string& what) override {
    if (line >= 0) return;
    line = at_line;
    column = at_column;
    message = what;
  }
};

/// The part of `s` between two texts; empty if one of them is missing.
std::string between(const std::string& s, const std::string& open, const std::string& close) {
  const auto from = s.find(open);
  if (from == std::string::npos) return {};
  const auto begin = from + open.size();
  const auto end = s.find(close, begin);
  return end == std::string::npos ? std::string() : s.substr(begin, end - begin);
}

std::string suggestion(const std::string& message_type, const std::string& wrong) {
  const pb::Descriptor* const type = pb::DescriptorPool::generated_pool()->FindMessageTypeByName(message_type);
  if (type == nullptr) return {};
  std::vector<std::string> names;
  for (int i = 0; i < type->field_count(); ++i) names.push_back(type->field(i)->name());
  return nearest_name(wrong, names);
}

/// Index of the character at a position of protobuf's tokenizer, which advances a tab to the next multiple of 8
/// columns.
std::size_t index_of(const std::string& text, int line, int column) {
  std::size_t at = 0;
  for (; line > 0; --line) at = text.find('\n', at) + 1;
  for (int here = 0; here < column; ++at) here += text[at] == '\t' ? 8 - here % 8 : 1;
  return at;
}

/// Index of the token before a position of the tokenizer.
std::size_t token_before(const std::string& text, int line, int column) {
  FirstError ignored;
  pb::io::ArrayInputStream stream(text.data(), static_cast<int>(text.size()));
  pb::io::Tokenizer tokens(&stream, &ignored);
  // As TextFormat::Parser sets them.
  tokens.set_comment_style(pb::io::Tokenizer::SH_COMMENT_STYLE);
  tokens.set_allow_f_after_float(true);
  tokens.set_require_space_after_number(false);
  tokens.set_allow_multiline_strings(true);
  while (tokens.Next() && std::pair(tokens.current().line, tokens.current().column) < std::pair(line, column)) {
  }
  return index_of(text, tokens.previous().line, tokens.previous().column);
}

}  // namespace

Status parse_text_message(std::string_view text, const std::string& name, pb::Message& message,
                          std::vector<std::string>* warnings) {
  for (std::string current_text(text);;) {
    FirstError error;
    pb::TextFormat::Parser parser;
    parser.RecordErrorsTo(&error);
    if (parser.ParseFromString(current_text, &message)) return {};
    // For an unknown field: Message type "x.Y" has no field named "z".
    const std::string type = between(error.message, "Message type \"", "\"");
    const std::string wrong = between(error.message, "no field named \"", "\"");
    const std::string current(current_field_name(type, wrong));
    if (current == wrong)
      return invalid_argument(name + ":" + std::to_string(error.line + 1) + ":" + std::to_string(error.column + 1) +
                              ": " + error.message + suggestion(type, wrong));
    // The error is at the token after the name.
    const std::size_t begin = token_before(current_text, error.line, error.column);
    const auto line = 1 + std::ranges::count(std::string_view(current_text).substr(0, begin), '\n');
    current_text.replace(begin, wrong.size(), current);
    if (warnings == nullptr) continue;
    warnings->push_back(name + ":" + std::to_string(line) + ": field '" + wrong + "' is now called '" + current +
                        "': the former name is deprecated");
  }
}

std::string text_of(const pb::Message& message) {
  std::string text;
  pb::TextFormat::PrintToString(message, &text);
  return text;
}

}  // namespace lightwell
