#include "link/web/metrics.hpp"

#include <cstdint>
#include <string_view>

namespace lightwell {
namespace {

/// A label's value: backslash, quote and line feed are escaped; other control characters are left out.
std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '\\' || c == '"') out += '\\';
    if (c == '\n') out += "\\n";
    if (static_cast<unsigned char>(c) >= ' ') out += c;
  }
  return out + "\"";
}

struct Family {
  std::string_view name, type, help;
  std::uint64_t value;
};

}  // namespace

std::string metrics_text(const StatusSnapshot& s) {
  const Counters& c = s.counters;
  const Family families[] = {
      {"frames_total", "counter", "Frames that the camera delivered.", c.frames},
      {"frames_lost_total", "counter", "Frames that were exposed and not delivered.", c.frames_lost},
      {"frames_recorded_total", "counter", "Frames that were recorded.", c.frames_recorded},
      {"recording_faults_total", "counter", "Faults of the recording.", c.recording_faults},
      {"captures_dropped_total", "counter", "Captures that a newer one replaced.", c.captures_dropped},
      {"brackets_incomplete_total", "counter", "Brackets that lacked an exposure.", c.brackets_incomplete},
      {"estimates_total", "counter", "Captures that gave a descriptor.", c.estimates},
      {"estimates_failed_total", "counter", "Captures that the estimator refused.", c.estimates_failed},
      {"estimates_late_total", "counter", "Estimates that took longer than the budget.", c.estimates_late},
      {"estimates_late_at_fast_total", "counter", "Late estimates at the cheapest setting.", c.estimates_late_at_fast},
      {"setting_moves_total", "counter", "Changes of the setting by the budget.", c.setting_moves},
      {"descriptors_coalesced_total", "counter", "Descriptors that slow clients did not receive.",
       c.descriptors_coalesced},
      {"messages_refused_total", "counter", "Messages from clients that were refused.", c.messages_refused},
      {"authentication_failures_total", "counter", "Calls without a valid token or certificate.",
       c.authentication_failures},
      {"client_list_faults_total", "counter", "Changes of the client list that could not be read.",
       c.client_list_faults},
      {"clients", "gauge", "Clients of all links.", c.clients}};
  std::string out =
      "# HELP lightwell_info The probe.\n# TYPE lightwell_info gauge\nlightwell_info{name=" + quoted(s.probe_name) +
      ",version=" + quoted(s.version) + ",camera=" + quoted(s.camera) + "} 1\n";
  if (s.temperature_c)
    out +=
        "# HELP lightwell_temperature_celsius Temperature of the probe's machine.\n"
        "# TYPE lightwell_temperature_celsius gauge\nlightwell_temperature_celsius " +
        std::to_string(*s.temperature_c) + "\n";
  if (s.recording)
    out +=
        "# HELP lightwell_recording Whether the probe records what it sends.\n# TYPE lightwell_recording gauge\n"
        "lightwell_recording " +
        std::to_string(static_cast<int>(s.recording->running)) +
        "\n# HELP lightwell_recording_ends_total Recordings that a fault or a limit ended.\n"
        "# TYPE lightwell_recording_ends_total counter\nlightwell_recording_ends_total " +
        std::to_string(s.recording->faults) + "\n";
  for (const Family& f : families)
    out += "# HELP lightwell_" + std::string(f.name) + " " + std::string(f.help) + "\n# TYPE lightwell_" +
           std::string(f.name) + " " + std::string(f.type) + "\nlightwell_" + std::string(f.name) + " " +
           std::to_string(f.value) + "\n";
  return out;
}

}  // namespace lightwell
