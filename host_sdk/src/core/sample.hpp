// One stored descriptor with the values that queries need.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/harmonics.hpp>
#include <lightwell/time.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "core/environment_assembler.hpp"
#include "core/lazy_reconstruction.hpp"
#include "core/receiver_lights.hpp"

namespace lightwell::core {

/// Immutable once shared. Holds what is the same for all queries, computed once by prepare().
struct Sample {
  Descriptor descriptor;
  IrradianceSh irradiance;                     ///< irradiance_of(descriptor.radiance): without the lights.
  std::vector<ReceiverLight> receiver_lights;  ///< receiver_lights(descriptor.lights).
  HostTime mid_exposure;
  Duration time_uncertainty;  ///< Maximum error of mid_exposure.
  HostTime received;
  std::size_t encoded_bytes = 0;
  /// The environment map at that time, from this or an earlier message; null if there is none.
  std::shared_ptr<const EnvironmentSnapshot> environment;
  /// For radiance() without a map; null if there is a map.
  LazyReconstruction::Pointer reconstruction;
  /// The probe's mounting, as long as `descriptor` is in the probe's frame; null if the probe reported none.
  std::shared_ptr<const UncertainPose> T_world_probe;
  Quat environment_rotation;  ///< Rotates directions of the map into the frame of `descriptor`.
};

/// Recomputes `irradiance` and `receiver_lights` after a change of the descriptor.
inline void prepare(Sample& sample) {
  sample.irradiance = irradiance_of(sample.descriptor.radiance);
  sample.receiver_lights = receiver_lights(sample.descriptor.lights);
}

/// Call it after `environment` is set.
inline void add_reconstruction(Sample& sample) {
  if (sample.environment == nullptr)
    sample.reconstruction = std::make_shared<const LazyReconstruction>(sample.descriptor.radiance);
}

/// A sample without time, bytes or reconstruction.
[[nodiscard]] inline Sample sample_of(Descriptor descriptor) {
  Sample sample;
  sample.descriptor = std::move(descriptor);
  prepare(sample);
  return sample;
}

}  // namespace lightwell::core
