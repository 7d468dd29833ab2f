// Notifications to systemd (sd_notify). Without systemd the calls do nothing.
#pragma once

#include <string>

namespace lightwell {

/// READY=1 with STATUS=...: the camera runs and clients can connect.
void notify_ready(const std::string& status);
/// STATUS=...: one line for `systemctl status`, with WATCHDOG=1. Call it once a second; WatchdogSec must be larger.
void notify_status(const std::string& status);
/// STOPPING=1.
void notify_stopping();

}  // namespace lightwell
