// An EstimatorConfig message, whose fields are present or not, and the values that are.
#pragma once

#include <string>
#include <vector>

#include <lightwell/config.hpp>

#include "lightwell/v1/config.pb.h"

namespace lightwell {

struct ReceivedUpdate {
  EstimatorUpdate update;
  std::vector<std::string> warnings;  ///< One for each deprecated field: its name, and what to write.
};
/// The fields that the message has, for an estimator of this kind. A number that no enumerator has becomes 0, which is
/// none of its values and never valid.
[[nodiscard]] ReceivedUpdate update_of(v1::EstimatorConfig m, EstimatorKind kind);
/// Sets the fields that `update` has, and no other.
void fill_config(const EstimatorUpdate& update, v1::EstimatorConfig& m);
/// With every field set that is not deprecated.
[[nodiscard]] v1::EstimatorConfig message_of(const EstimatorConfig& config);

}  // namespace lightwell
