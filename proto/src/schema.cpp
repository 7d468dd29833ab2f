#include <set>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <lightwell/schema.hpp>

#include "lightwell/v1/captured_plane.pb.h"
#include "lightwell/v1/descriptor.pb.h"

namespace lightwell {
namespace {

/// Imports before the file that imports them.
void add_file(const google::protobuf::FileDescriptor& file, std::set<std::string>& added,
              google::protobuf::FileDescriptorSet& out) {
  if (!added.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) add_file(*file.dependency(i), added, out);
  file.CopyTo(out.add_file());
}

MessageSchema schema_of(const google::protobuf::Descriptor& message) {
  google::protobuf::FileDescriptorSet files;
  std::set<std::string> added;
  add_file(*message.file(), added, files);
  return {message.full_name(), files.SerializeAsString()};
}

}  // namespace

MessageSchema message_schema(RecordedMessage message) {
  switch (message) {
    case RecordedMessage::descriptor:
      return schema_of(*v1::LightingDescriptor::descriptor());
    case RecordedMessage::plane:
      return schema_of(*v1::PlaneUpdate::descriptor());
    case RecordedMessage::unknown:
      break;
  }
  return {};
}

}  // namespace lightwell
