#include "text_message.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <numeric>
#include <set>
#include <sstream>
#include <vector>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/text_format.h>

namespace lightwell {
namespace {

namespace pb = google::protobuf;

/// Keeps the first error, because later ones are usually consequences of it.
class FirstError final : public pb::io::ErrorCollector {
 public:
  void AddError(int line, pb::io::ColumnNumber column, const std::string& message) override {
    if (found_) return;
    found_ = true;
    line_ = line + 1;
    column_ = column + 1;
    message_ = message;
  }
  [[nodiscard]] bool found() const { return found_; }
  [[nodiscard]] int line() const { return line_; }
  [[nodiscard]] int column() const { return column_; }
  [[nodiscard]] const std::string& message() const { return message_; }

 private:
  bool found_ = false;
  int line_ = 0, column_ = 0;
  std::string message_;
};

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row.back();
}

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

}  // namespace

std::string nearest_name(std::string_view wrong, const std::vector<std::string>& names) {
  std::string nearest, all;
  std::size_t smallest = std::string::npos;
  for (const std::string& name : names) {
    all += (all.empty() ? "" : ", ") + name;
    // A name without the part before its last dot also matches.
    const std::size_t d = std::min(edit_distance(wrong, name), edit_distance(wrong, name.substr(name.rfind('.') + 1)));
    if (d < smallest) {
      smallest = d;
      nearest = name;
    }
  }
  if (nearest.empty()) return {};
  // A name that differs in more than half its length is hardly a typing error: list all names.
  if (smallest * 2 > std::max(wrong.size(), nearest.size()))
    return " (nearest known name: '" + nearest + "'; known: " + all + ")";
  return " (did you mean '" + nearest + "'?)";
}

Result<std::string> read_text_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return Status(StatusCode::not_found, path + ": " + std::strerror(errno));
  std::ostringstream text;
  text << in.rdbuf();
  if (in.bad()) return Status(StatusCode::data_loss, path + ": could not be read to its end");
  return text.str();
}

Status parse_text_message(std::string_view text, const std::string& name, pb::Message& message) {
  FirstError errors;
  pb::TextFormat::Parser parser;
  parser.RecordErrorsTo(&errors);
  pb::io::ArrayInputStream stream(text.data(), static_cast<int>(text.size()));
  if (parser.Parse(&stream, &message)) return {};
  const std::string where =
      errors.found() ? ":" + std::to_string(errors.line()) + ":" + std::to_string(errors.column()) : "";
  return {StatusCode::invalid_argument,
          name + where + ": " + errors.message() + suggestion(errors.message(), message.GetDescriptor())};
}

}  // namespace lightwell
