// Waiting for an environment map, which a probe sends more rarely than descriptors.
#pragma once

#include <lightwell/probe.hpp>

namespace lightwell::tool {

/// A whole map comes about once a second. A probe that sends none costs this long to find out.
inline constexpr Duration kMapTimeout{1'500'000'000};

/// The newest lighting as soon as it has a map, or what there is after kMapTimeout or at the end
/// of a recording: perhaps one without a map, perhaps none.
[[nodiscard]] Lighting lighting_with_map(const Probe& probe);

}  // namespace lightwell::tool
