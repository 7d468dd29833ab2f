// lightwelld: creates camera, estimator and links from a configuration and runs them until a signal, or pairs a client.
#pragma once

#include <string>
#include <string_view>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

inline constexpr std::string_view kFirmwareVersion = LIGHTWELL_VERSION;

/// The daemon's log: one line per message on stderr; control characters are escaped.
void log_info(const std::string& line);
void log_error(const std::string& line);

/// Blocks SIGINT and SIGTERM in this thread and all threads it starts; call it before anything else.
void block_stop_signals();
/// Whether SIGINT or SIGTERM is pending. Any thread.
[[nodiscard]] bool stop_signal_pending();

/// Runs until SIGINT or SIGTERM, or until the camera has finished and the last descriptor was published. Logs to
/// stderr; prints "lightwelld: listening on grpc://..." to stdout when clients can connect.
[[nodiscard]] Status run_daemon(const Config& config);

/// `lightwelld --pair`: opens a pairing window for one client, prints its address and code to stdout, and waits until
/// it closes or a signal comes. `listen`: HOST:PORT; empty: the host of the gRPC link with port 7421.
/// failed_precondition: the configuration has no encryption; unavailable: no client was paired.
[[nodiscard]] Status run_pairing(const Config& config, const std::string& listen);

/// Opens the camera, loads the calibration and creates the estimator, but does not run.
[[nodiscard]] Status check_daemon(const Config& config);

}  // namespace lightwell
