// An estimator that returns constant light: step 3 of "An estimator" in CONTRIBUTING.md.
#pragma once

#include <cstdint>
#include <memory>

#include <lightwell/calibration.hpp>

#include "estimate/estimator.hpp"

namespace lightwell {

struct ConstantOptions {
  EstimatorConfig config;
  std::uint32_t probe_id = 0;
};

/// Radiance 1 from everywhere, whatever the frames show; no error bound. invalid_argument where the rig or an option is
/// invalid.
[[nodiscard]] Result<std::unique_ptr<Estimator>> make_constant_estimator(const RigParameters& rig,
                                                                         const ConstantOptions& options);

}  // namespace lightwell
