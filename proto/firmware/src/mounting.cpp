#include <google/protobuf/text_format.h>

#include <lightwell/files.hpp>
#include <lightwell/mounting.hpp>

#include "mounting_message.hpp"
#include "text_message.hpp"

namespace lightwell {

Result<UncertainPose> parse_mounting(std::string_view text, const std::string& name) {
  v1::Mounting m;
  if (const Status s = parse_text_message(text, name, m); !s.ok()) return s;
  const Result<UncertainPose> out = mounting_from(m);
  return out.ok() ? out : Status(out.status().code(), name + ": " + out.status().message());
}

Result<UncertainPose> load_mounting(const std::string& path) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.status();
  return parse_mounting(*text, path);
}

std::string mounting_to_text(const UncertainPose& T_world_probe) {
  std::string text;
  google::protobuf::TextFormat::PrintToString(mounting_to(T_world_probe), &text);
  return text;
}

}  // namespace lightwell
