// Parsing of messages in protobuf text format, with errors that name the position and the nearest known field.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <google/protobuf/message.h>

#include <lightwell/result.hpp>

namespace lightwell {

/// Fills `message`. Errors: "NAME:LINE:COLUMN: what; did you mean 'nearest'?".
[[nodiscard]] Status parse_text_message(std::string_view text, const std::string& name,
                                        google::protobuf::Message& message);
/// The same for text that may have former names of fields (renamed_fields.hpp): appends to `warnings` for each.
[[nodiscard]] Status parse_text_message(std::string_view text, const std::string& name,
                                        google::protobuf::Message& message, std::vector<std::string>& warnings);

}  // namespace lightwell
