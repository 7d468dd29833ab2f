// Where the light comes from: a probe, a recording, or the scene itself.
#pragma once

#include <memory>

#include <lightwell/lighting.hpp>
#include <lightwell/result.hpp>

#include "ar_viewer/scene.hpp"

namespace lightwell::viewer {

class LightSource {
 public:
  LightSource() = default;
  LightSource(const LightSource&) = delete;
  LightSource& operator=(const LightSource&) = delete;
  virtual ~LightSource() = default;

  /// The light of the next frame, in the probe's axes. Of a recording its next descriptor, at last the last one; of a
  /// probe the newest. Does not block.
  [[nodiscard]] virtual Lighting next() = 0;
};

/// Waits up to two seconds for the first descriptor of a probe. The errors of Probe::connect(); not_found and data_loss
/// for a file; resource_exhausted for a file that is larger than any descriptor.
[[nodiscard]] Result<std::unique_ptr<LightSource>> open_light_source(const LightDescription& description);

}  // namespace lightwell::viewer
