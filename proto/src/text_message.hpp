// Messages in protobuf text format, with errors that a person can act on.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <google/protobuf/message.h>

#include <lightwell/result.hpp>

namespace lightwell {

/// The whole file. not_found or data_loss, naming the path.
[[nodiscard]] Result<std::string> read_text_file(const std::string& path);

/// Fills `message`. Errors: "NAME:LINE:COLUMN: what; did you mean 'nearest'?".
[[nodiscard]] Status parse_text_message(std::string_view text, const std::string& name,
                                        google::protobuf::Message& message);

/// For the end of a message about a name that is none of `names`: " (did you mean 'nearest'?)".
[[nodiscard]] std::string nearest_name(std::string_view wrong, const std::vector<std::string>& names);

}  // namespace lightwell
