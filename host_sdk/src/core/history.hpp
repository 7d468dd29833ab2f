// The last descriptors of a probe, and queries at a time: interpolation, short extrapolation, staleness.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/time.hpp>

#include "core/sample.hpp"

namespace lightwell::core {

/// Immutable once shared: the writer makes a new one for every descriptor, so that readers see a consistent history
/// without a lock. Ascending in mid_exposure, never empty.
struct History {
  std::vector<std::shared_ptr<const Sample>> samples;
};

/// `before` (may be null) with one more sample, at most `capacity` in all. Samples that are not older than the new one
/// are removed: the clock was corrected, or the probe restarted.
[[nodiscard]] std::shared_ptr<const History> appended(const History* before, std::shared_ptr<const Sample> sample,
                                                      std::size_t capacity);

/// The newest sample; Validity::none if `history` is null.
[[nodiscard]] Lighting newest_lighting(const History* history, HostTime now, Duration max_age);

/// As Probe::at().
[[nodiscard]] Lighting lighting_at(const History* history, HostTime time, Duration max_age, Duration extrapolation);

/// Descriptor at the fraction `f` (0 to 1) between `a` and `b`. Harmonics are interpolated linearly; a band that only
/// one has is zero in the other. Lights with the same track move along the great circle, with linear irradiance, and
/// linear distance if both are known, otherwise that of the nearer descriptor; a light that only one has fades. The
/// origin moves along a line and turns about one axis. Bounds, coverage and flags are the worse of the two. Sequence,
/// identities and environment map are those of the nearer descriptor; if units or calibration differ, so is everything.
[[nodiscard]] Descriptor interpolated(const Descriptor& a, const Descriptor& b, float f);

/// `newest` with its lights extrapolated: each light that `before` has too is rotated by `f` (>= 0) times its rotation
/// since then, at most by pi. The error bound grows by the change of irradiance. Distances and origin stay. If units or
/// calibration differ: `newest` unchanged.
[[nodiscard]] Descriptor extrapolated(const Descriptor& before, const Descriptor& newest, float f);

}  // namespace lightwell::core
