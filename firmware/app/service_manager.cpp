#include "app/service_manager.hpp"

#include <systemd/sd-daemon.h>

#include <lightwell/printable.hpp>

namespace lightwell {

void notify_ready(const std::string& status) { sd_notify(0, ("READY=1\nSTATUS=" + printable(status)).c_str()); }
void notify_status(const std::string& status) { sd_notify(0, ("WATCHDOG=1\nSTATUS=" + printable(status)).c_str()); }
void notify_stopping() { sd_notify(0, "STOPPING=1"); }

}  // namespace lightwell
