// One descriptor as the SDK keeps it.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/harmonics.hpp>
#include <lightwell/time.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "core/environment_keeper.hpp"
#include "core/lazy_reconstruction.hpp"
#include "core/receiver_lights.hpp"

namespace lightwell::core {

/// Immutable once shared. What a query would do again and again is done here, once: prepare().
struct Sample {
  Descriptor descriptor;
  IrradianceSh irradiance;                     ///< irradiance_of(descriptor.radiance): without the lights.
  std::vector<ReceiverLight> receiver_lights;  ///< Of descriptor.lights.
  HostTime mid_exposure;
  Duration time_uncertainty;  ///< The true mid_exposure is within this of it.
  HostTime received;
  std::size_t encoded_bytes = 0;
  /// The map that held when this was so, whichever message brought it; null where there was none.
  std::shared_ptr<const KeptEnvironment> environment;
  /// radiance() evaluates it where there is no map; null where there is one.
  LazyReconstruction::Pointer reconstruction;
  /// Where the probe said that it hangs, while its frame is the descriptor's; null where it did not.
  std::shared_ptr<const UncertainPose> T_world_probe;
  Quat environment_rotation;  ///< Takes directions of the map into those of `descriptor`.
};

/// After a change of the descriptor: its harmonics convolved with the cosine, its lights as receivers ask for them.
inline void prepare(Sample& sample) {
  sample.irradiance = irradiance_of(sample.descriptor.radiance);
  sample.receiver_lights = receiver_lights(sample.descriptor.lights);
}

/// Once it is known whether a map holds.
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
