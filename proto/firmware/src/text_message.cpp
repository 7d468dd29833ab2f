#include "text_message.hpp"

#include <algorithm>
#include <cctype>
#include <set>

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
  std::string where;  ///< ":LINE:COLUMN"; empty without an error.
  std::string message;

  void AddError(int line, pb::io::ColumnNumber column, const std::string& what) override {
    if (!where.empty()) return;
    where = ":" + std::to_string(line + 1) + ":" + std::to_string(column + 1);
    message = what;
  }
};

const pb::Descriptor* find_type(const pb::Descriptor* root, std::string_view full_name, std::set<const void*>& seen) {
  if (root->full_name() == full_name) return root;
  if (!seen.insert(root).second) return nullptr;
  for (int i = 0; i < root->field_count(); ++i)
    if (const pb::Descriptor* inner = root->field(i)->message_type())
      if (const pb::Descriptor* found = find_type(inner, full_name, seen)) return found;
  return nullptr;
}

std::string between(const std::string& s, const std::string& open, const std::string& close) {
  const auto from = s.find(open);
  if (from == std::string::npos) return {};
  const auto begin = from + open.size();
  const auto end = s.find(close, begin);
  return end == std::string::npos ? std::string() : s.substr(begin, end - begin);
}

/// Parses protobuf's error: Message type "x.Y" has no field named "z".
std::string suggestion(const std::string& error, const pb::Descriptor* root) {
  std::set<const void*> seen;
  const std::string wrong = between(error, "no field named \"", "\"");
  const pb::Descriptor* type = find_type(root, between(error, "Message type \"", "\""), seen);
  if (wrong.empty() || type == nullptr) return {};
  std::vector<std::string> names;
  for (int i = 0; i < type->field_count(); ++i) names.push_back(type->field(i)->name());
  return nearest_name(wrong, names);
}

bool in_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.'; }

/// The first token of protobuf text from `at` on, without spaces and comments: a string, a word, or one character.
/// Empty at the end.
std::string_view token_from(std::string_view text, std::size_t at) {
  while (at < text.size() && (text[at] == '#' || std::isspace(static_cast<unsigned char>(text[at])) != 0))
    at = text[at] == '#' ? std::min(text.find('\n', at), text.size()) : at + 1;
  if (at == text.size()) return {};
  std::size_t end = at;
  if (text[at] == '"' || text[at] == '\'') {
    do {
      end += text[end] == '\\' ? 2 : 1;
    } while (end < text.size() && text[end] != text[at]);
    ++end;
  } else {
    while (end < text.size() && in_word(text[end])) ++end;
    end = std::max(end, at + 1);
  }
  return text.substr(at, end - at);
}

/// `text` of a message of type `root` with current names of fields; appends to `warnings` for each former name.
std::string with_current_names(std::string_view text, const std::string& name, const pb::Descriptor& root,
                               std::vector<std::string>& warnings) {
  struct Level {
    const pb::Descriptor* message;  ///< Null: unknown.
    const pb::Descriptor* inner;    ///< Type of the field named last, if that is a message.
  };
  std::vector<Level> levels{{&root, nullptr}};
  std::string out;
  std::size_t copied = 0;
  for (std::string_view token = token_from(text, 0), following; !token.empty(); token = following) {
    const auto begin = static_cast<std::size_t>(token.data() - text.data());
    following = token_from(text, begin + token.size());
    if (token == "{" || token == "<") {
      levels.push_back({levels.back().inner, nullptr});
    } else if (token == "}" || token == ">") {
      if (levels.size() > 1) levels.pop_back();
    } else if (Level& level = levels.back(); level.message != nullptr && in_word(token[0]) &&
                                             (following == ":" || following == "{" || following == "<")) {
      const std::string_view current = current_field_name(level.message->full_name(), token);
      const pb::FieldDescriptor* const field = level.message->FindFieldByName(std::string(current));
      level.inner = field == nullptr ? nullptr : field->message_type();
      if (current == token) continue;
      out.append(text.substr(copied, begin - copied)).append(current);
      copied = begin + token.size();
      warnings.push_back(name + ":" + std::to_string(1 + std::count(text.begin(), text.begin() + begin, '\n')) +
                         ": field '" + std::string(token) + "' is now called '" + std::string(current) +
                         "': the former name is deprecated");
    }
  }
  return out.append(text.substr(copied));
}

}  // namespace

Status parse_text_message(std::string_view text, const std::string& name, pb::Message& message) {
  FirstError error;
  pb::TextFormat::Parser parser;
  parser.RecordErrorsTo(&error);
  pb::io::ArrayInputStream stream(text.data(), static_cast<int>(text.size()));
  if (parser.Parse(&stream, &message)) return {};
  return invalid_argument(name + error.where + ": " + error.message +
                          suggestion(error.message, message.GetDescriptor()));
}

Status parse_text_message(std::string_view text, const std::string& name, pb::Message& message,
                          std::vector<std::string>& warnings) {
  Status parsed = parse_text_message(text, name, message);
  if (parsed.ok()) return parsed;
  std::vector<std::string> renamed;
  const std::string current = with_current_names(text, name, *message.GetDescriptor(), renamed);
  if (renamed.empty()) return parsed;
  warnings.insert(warnings.end(), renamed.begin(), renamed.end());
  return parse_text_message(current, name, message);
}

std::string text_of(const pb::Message& message) {
  std::string text;
  pb::TextFormat::PrintToString(message, &text);
  return text;
}

}  // namespace lightwell
