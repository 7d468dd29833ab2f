// Conversion of EstimatorConfig messages, with field presence, to and from values.
#pragma once

#include <string>
#include <vector>

#include <lightwell/estimator_config.hpp>

#include "lightwell/v1/config.pb.h"

namespace lightwell {

struct ReceivedUpdate {
  EstimatorUpdate update;
  std::vector<std::string> warnings;  ///< One for each deprecated field: its name and its replacement.
};
/// The fields that are present in the message, for an estimator of this kind. An unknown enum value becomes 0, which is
/// never valid.
[[nodiscard]] ReceivedUpdate update_of(v1::EstimatorConfig m, EstimatorKind kind);
/// Sets exactly the fields of `update` that have a value.
void fill_config(const EstimatorUpdate& update, v1::EstimatorConfig& m);
/// Sets every field that is not deprecated.
[[nodiscard]] v1::EstimatorConfig message_of(const EstimatorConfig& config);

}  // namespace lightwell
