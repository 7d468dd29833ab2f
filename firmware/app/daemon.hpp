// lightwelld: creates camera, estimator and links from a configuration and runs them until a signal.
#pragma once

#include <string_view>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

inline constexpr std::string_view kFirmwareVersion = LIGHTWELL_VERSION;

/// Blocks SIGINT and SIGTERM in this thread and all threads it starts; call it before anything else.
void block_stop_signals();
/// Whether SIGINT or SIGTERM is pending. Any thread.
[[nodiscard]] bool stop_signal_pending();

/// Runs until SIGINT or SIGTERM, or until the camera has finished and the last descriptor was published. Logs to
/// stderr; prints "lightwelld: listening on grpc://..." to stdout when clients can connect.
[[nodiscard]] Status run_daemon(const Config& config);

/// Opens the camera, loads the calibration and creates the estimator, but does not run.
[[nodiscard]] Status check_daemon(const Config& config);

}  // namespace lightwell
