// Messages in protobuf text format; parsing with errors that name the position and the nearest known field.
#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include <google/protobuf/message.h>

#include <lightwell/files.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// Fills `message`. Errors: "NAME:LINE:COLUMN: what; did you mean 'nearest'?". Former names of fields (field_names.hpp)
/// are accepted, each with a line appended to `warnings`.
[[nodiscard]] Status parse_text_message(std::string_view text, const std::string& name,
                                        google::protobuf::Message& message,
                                        std::vector<std::string>* warnings = nullptr);

/// parse(content, path) of a file.
template <class Parse>
[[nodiscard]] auto load_text(const std::string& path, Parse parse) -> decltype(parse(std::string_view(), path)) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.status();
  return parse(*text, path);
}

/// Requires a rotation that is finite and not zero. A unit quaternion is returned unchanged, so that writing and
/// reading a pose restores it exactly.
[[nodiscard]] inline Quat unit_rotation(const Quat& q) {
  return std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) > 1e-12 ? q.normalized() : q;
}

/// Text from which parse_text_message() restores the message.
[[nodiscard]] std::string text_of(const google::protobuf::Message& message);

}  // namespace lightwell
