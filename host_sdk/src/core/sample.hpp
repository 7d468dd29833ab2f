// One descriptor as the SDK keeps it.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>

#include <lightwell/descriptor.hpp>
#include <lightwell/harmonics.hpp>
#include <lightwell/time.hpp>

#include "core/environment_keeper.hpp"

namespace lightwell::core {

/// Immutable once shared. The convolution with the cosine is done here, once, so that a query only
/// evaluates.
struct Sample {
  Descriptor descriptor;
  IrradianceSh irradiance;  ///< irradiance_of(descriptor.radiance): without the lights.
  HostTime mid_exposure;
  HostTime received;
  std::size_t encoded_bytes = 0;
  /// The map that held when this was so, whichever message brought it; null where there was none.
  std::shared_ptr<const KeptEnvironment> environment;
  Quat environment_rotation;  ///< Takes directions of the map into those of `descriptor`.
};

/// A sample without time or bytes, its irradiance evaluated.
[[nodiscard]] inline Sample sample_of(Descriptor descriptor) {
  Sample sample;
  sample.irradiance = irradiance_of(descriptor.radiance);
  sample.descriptor = std::move(descriptor);
  return sample;
}

}  // namespace lightwell::core
