// Parsing of messages in protobuf text format, with errors that name the position and the nearest known field.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <google/protobuf/message.h>

#include <lightwell/result.hpp>

namespace lightwell {

/// Reads the whole file. not_found or data_loss, naming the path.
[[nodiscard]] Result<std::string> read_text_file(const std::string& path);

/// Fills `message`. Errors: "NAME:LINE:COLUMN: what; did you mean 'nearest'?".
[[nodiscard]] Status parse_text_message(std::string_view text, const std::string& name,
                                        google::protobuf::Message& message);

/// Suffix of an error message about a name that is not one of `names`: " (did you mean 'nearest'?)".
[[nodiscard]] std::string nearest_name(std::string_view wrong, const std::vector<std::string>& names);

}  // namespace lightwell
