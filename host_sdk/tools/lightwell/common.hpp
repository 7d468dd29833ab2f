// The tool's options and commands; exit codes, output and the connection to the probe, which the commands share.
#pragma once

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <lightwell/probe.hpp>

namespace CLI {
class App;
}

namespace lightwell::tool {

/// The options of all commands. Empty texts: not given.
struct Options {
  std::string uri;          ///< doctor: may be empty.
  std::string credentials;  ///< Folder; empty: looked up.
  bool json = false;
  double seconds = 0;             ///< watch, record; 0: until the recording ends or the tool is interrupted.
  std::string file;               ///< watch, record: to write; replay: to read.
  bool plane = false;             ///< record: captured planes, too.
  bool mcap = false;              ///< record: as an MCAP file.
  std::string normal, direction;  ///< query: "x,y,z".
  double roughness = 1;
  bool lights = false;
  bool no_map = false;              ///< info: leave out the environment map, for which it may have to wait.
  std::vector<std::string> fields;  ///< config set: "name=value".
  double timeout = 2;               ///< discover, s.
  std::string broker, ca_file, login_file;
  std::string code;         ///< pair; empty: read from stdin.
  std::string name, store;  ///< pair; empty: the SDK's defaults.
};

/// Each returns the exit code.
int run_watch(const Options& options);
int run_query(const Options& options);
int run_record(const Options& options);
int run_replay(const Options& options);
int run_info(const Options& options);
int run_config_get(const Options& options);
int run_config_set(const Options& options);
int run_calibration(const Options& options);
int run_recording_start(const Options& options);
int run_recording_stop(const Options& options);
int run_recording_status(const Options& options);
int run_discover(const Options& options);
int run_doctor(const Options& options);
int run_pair(const Options& options);

/// The probe's own recording in one line, and as JSON with the names of RecordingStatus.
[[nodiscard]] std::string recording_text(const RecordingStatus& recording);
[[nodiscard]] nlohmann::ordered_json recording_json(const RecordingStatus& recording);

enum ExitCode : int { kOk = 0, kNothingReceived = 1, kUsage = 2, kUnreachable = 3, kFile = 4 };

/// Writes "lightwell: ..." to stderr.
void warn(std::string_view message);

/// Ends a command; parse() writes the message as warn() does.
struct Failure : std::runtime_error {
  Failure(ExitCode exit_code, const std::string& message) : std::runtime_error(message), code(exit_code) {}
  ExitCode code;
};
[[noreturn]] void fail(ExitCode code, const std::string& message);
/// Fails if the status is not ok; without `code` with the exit code for the status.
void require(const Status& status, std::optional<ExitCode> code = std::nullopt);
/// The value of the result, if its status is ok.
template <class T>
[[nodiscard]] T require(Result<T> result, std::optional<ExitCode> code = std::nullopt) {
  require(result.status(), code);
  return std::move(*result);
}

/// Parses the arguments, which runs the callbacks of commands, and reports what fails. Returns the exit code: kOk also
/// after --help and --version.
[[nodiscard]] int parse(CLI::App& app, int argc, const char* const* argv);

/// The document in one line of ASCII, which is safe to print: all other characters and control characters are escaped.
/// A byte sequence that is not UTF-8 becomes U+FFFD. A number has the shortest text that gives the same double when
/// parsed; NaN and infinity become null.
[[nodiscard]] std::string json_text(const nlohmann::ordered_json& document);
/// Prints json_text() and a line break.
void print_json(const nlohmann::ordered_json& document);

[[nodiscard]] std::vector<std::string_view> flag_names(Flags flags);
/// "unseen clipped", or "-" for none.
[[nodiscard]] std::string flags_text(Flags flags);
/// "1.2 %", or "infinite".
[[nodiscard]] std::string bound_text(float bound);

/// From the environment variables LIGHTWELL_MQTT_CA, _CERTIFICATE, _KEY and _LOGIN, each the path of a file. There is
/// no option for the password, because every user of the machine can see arguments. Errors name the file.
[[nodiscard]] MqttCredentials broker_login();
/// Reads user (the first line of the file) and password (the second). not_found, invalid_argument.
[[nodiscard]] Status read_login(const std::string& path, MqttCredentials& credentials);

/// Connects to the probe of the options, with broker_login(). Planes are received if there is an `on_plane`.
[[nodiscard]] Probe connect(const Options& options, std::function<void(const Arrival&)> on_descriptor = {},
                            std::function<void(const PlaneArrival&)> on_plane = {});

/// Limit of the wait for a map, which a probe sends about once a second, or never.
inline constexpr Duration kMapTimeout{1'500'000'000};
/// The newest lighting as soon as it has an environment map; after kMapTimeout or at the end of a recording the newest
/// lighting, which may have no map or be Validity::none.
[[nodiscard]] Lighting lighting_with_map(const Probe& probe);

}  // namespace lightwell::tool
