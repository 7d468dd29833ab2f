// Former names of configuration fields, which text may still use. The numbers of the fields are the same.
#pragma once

#include <array>
#include <string_view>

namespace lightwell {

struct RenamedField {
  std::string_view message;  ///< Full name of the message type.
  std::string_view former, current;
};

inline constexpr std::array kRenamedFields = {
    RenamedField{"lightwell.v1.GrpcConfig", "listen", "listen_address"},
    RenamedField{"lightwell.v1.GrpcConfig", "keys", "key_folder"},
    RenamedField{"lightwell.v1.GrpcConfig", "paired_days", "client_certificate_days"},
    RenamedField{"lightwell.v1.MarkerConfig", "body", "body_file"},
    RenamedField{"lightwell.v1.PanoramaEstimatorConfig", "unseen", "unseen_fill"},
    RenamedField{"lightwell.v1.UsbGadgetConfig", "ffs", "functionfs_mount"},
};

/// The current name of a field of this message type: `name` itself, unless it is a former one.
[[nodiscard]] constexpr std::string_view current_field_name(std::string_view message, std::string_view name) {
  for (const RenamedField& field : kRenamedFields)
    if (field.message == message && field.former == name) return field.current;
  return name;
}

}  // namespace lightwell
