#include "map_wait.hpp"

namespace lightwell::tool {

Lighting lighting_with_map(const Probe& probe) {
  const HostTime deadline = HostTime{monotonic_now_ns()} + kMapTimeout;
  Lighting lighting = probe.latest();
  while (!lighting.environment()) {
    const Duration left = deadline - HostTime{monotonic_now_ns()};
    if (left <= Duration{}) break;
    // The end of a recording can be reported before its last descriptor was processed here.
    const bool over = probe.stats().state == LinkState::ended;
    std::optional<std::uint64_t> seen;
    if (lighting.validity() != Validity::none) seen = lighting.descriptor().sequence;
    const Result<Lighting> next = probe.wait_for_next(seen, left);
    if (next.ok()) lighting = *next;
    if (over || !next.ok()) break;
  }
  return lighting;
}

}  // namespace lightwell::tool
