// The MQTT link: descriptors and status retained at a broker, a last will, the clock on request. Topics:
// link/README.md.
#pragma once

#include <memory>
#include <string>

#include <lightwell/config.hpp>
#include <lightwell/status.hpp>

#include "link/link.hpp"

namespace lightwell {

/// `commands` must outlive stop(), and is called from the link's one thread. start() fails where the configuration
/// cannot work (invalid_argument) or a file of it is not there (not_found), not where the broker is away: then
/// trouble() says why, counters().clients is 0 instead of 1 (who listens behind a broker, nobody tells a probe), and it
/// is tried again.
[[nodiscard]] std::unique_ptr<Link> make_mqtt_link(const MqttConfig& config, const std::string& probe_name,
                                                   Commands& commands);

}  // namespace lightwell
