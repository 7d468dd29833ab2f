// Names of fields: former ones, which text may still use (the numbers of the fields are the same), and misspelt ones.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/text.hpp>

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

/// Suffix of an error message about a name that is not one of `names`: " (did you mean 'nearest'?)".
[[nodiscard]] inline std::string nearest_name(std::string_view wrong, const std::vector<std::string>& names) {
  std::string nearest;
  std::size_t smallest = std::string::npos;
  for (const std::string& name : names) {
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
    return " (nearest known name: '" + nearest + "'; known: " + joined(names) + ")";
  return " (did you mean '" + nearest + "'?)";
}

}  // namespace lightwell
