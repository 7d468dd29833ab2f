// Exit codes, output and the connection to the probe: shared by the tool's commands.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <lightwell/probe.hpp>

#include "commands.hpp"

namespace lightwell::tool {

enum ExitCode : int { kOk = 0, kNothingReceived = 1, kUsage = 2, kUnreachable = 3, kFile = 4 };

/// Writes "lightwell: ..." to stderr and returns `code`.
int fail(ExitCode code, std::string_view message);
/// The same, with the exit code for the status.
int fail(const Status& status);

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
[[nodiscard]] Result<MqttCredentials> broker_login();
/// Reads user (the first line of the file) and password (the second). not_found, invalid_argument.
[[nodiscard]] Status read_login(const std::string& path, MqttCredentials& credentials);

/// Connects to the probe of the options, with broker_login().
[[nodiscard]] Result<Probe> connect(const Options& options, std::function<void(const Arrival&)> on_descriptor = {});

/// Limit of the wait for a map, which a probe sends about once a second, or never.
inline constexpr Duration kMapTimeout{1'500'000'000};
/// The newest lighting as soon as it has an environment map; after kMapTimeout or at the end of a recording the newest
/// lighting, which may have no map or be Validity::none.
[[nodiscard]] Lighting lighting_with_map(const Probe& probe);

}  // namespace lightwell::tool
