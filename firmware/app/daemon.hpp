// lightwelld as a whole: builds the rooms from a configuration and runs them until a signal.
#pragma once

#include <string_view>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// Of the firmware.
inline constexpr std::string_view kFirmwareVersion = LIGHTWELL_VERSION;

/// Blocks SIGINT and SIGTERM in this thread and all that follow; call first.
void block_stop_signals();
/// One of them has come and waits to be taken. Any thread.
[[nodiscard]] bool stop_signal_pending();

/// Until SIGINT or SIGTERM, or until the camera has ended and every client could have the last descriptor. Logs to
/// stderr; prints "lightwelld: listening on grpc://..." to stdout once clients may come.
[[nodiscard]] Status run_daemon(const Config& config);

/// Everything but running: opens the camera, loads the calibration, makes the estimator.
[[nodiscard]] Status check_daemon(const Config& config);

}  // namespace lightwell
