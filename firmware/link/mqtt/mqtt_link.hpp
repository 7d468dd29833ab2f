// The MQTT link: publishes descriptors and status as retained messages with a last will, and messages of captured
// planes, and answers clock requests.
// Topics: proto/README.md.
#pragma once

#include <memory>
#include <string>

#include <lightwell/commands.hpp>
#include <lightwell/config.hpp>

#include "link/link.hpp"

namespace lightwell {

/// `commands` must be valid until stop() returns, and is called from the link's one thread. start() fails if the
/// configuration is invalid (invalid_argument) or one of its files is missing (not_found), but not if the broker is
/// unreachable: then error_message() gives the reason, and the link tries again. counters().clients is 1 with a
/// connected broker, otherwise 0; the number of subscribers is unknown.
[[nodiscard]] std::unique_ptr<Link> make_mqtt_link(const MqttConfig& config, const std::string& probe_name,
                                                   Commands& commands);

}  // namespace lightwell
