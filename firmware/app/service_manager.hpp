// What systemd wants to hear. Without systemd every call does nothing.
#pragma once

#include <string>

namespace lightwell {

/// READY=1: frames may come, clients may connect.
void notify_ready(const std::string& status);
/// STATUS=...: one line for `systemctl status`, and WATCHDOG=1: whoever says how it goes has not hung. To be called
/// each second, so a unit's WatchdogSec may be a few.
void notify_status(const std::string& status);
/// STOPPING=1.
void notify_stopping();

}  // namespace lightwell
