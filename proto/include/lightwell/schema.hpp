// The messages' protobuf definitions, for files that carry their own schema.
#pragma once

#include <string>

#include <lightwell/recording.hpp>

namespace lightwell {

struct MessageSchema {
  std::string name;  ///< Full name of the message, such as "lightwell.v1.LightingDescriptor".
  std::string
      file_descriptor_set;  ///< A google.protobuf.FileDescriptorSet with the file of the message and all its imports.
};

/// Of the messages in a recording; empty for RecordedMessage::unknown.
[[nodiscard]] MessageSchema message_schema(RecordedMessage message);

}  // namespace lightwell
