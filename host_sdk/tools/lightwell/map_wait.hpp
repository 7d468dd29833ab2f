// Waiting for an environment map, which a probe sends more rarely than descriptors.
#pragma once

#include <lightwell/probe.hpp>

namespace lightwell::tool {

/// Limit of the wait. A probe sends a whole map about once a second, or none at all.
inline constexpr Duration kMapTimeout{1'500'000'000};

/// The newest lighting as soon as it has a map; after kMapTimeout or at the end of a recording the newest lighting,
/// which may have no map or be Validity::none.
[[nodiscard]] Lighting lighting_with_map(const Probe& probe);

}  // namespace lightwell::tool
