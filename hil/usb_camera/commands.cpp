#include "usb_camera/commands.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <nlohmann/json.hpp>

#include "imaging/uri.hpp"
#include "tools/command_line.hpp"

namespace lightwell::usb_camera {
namespace {

/// A command with its values, a JSON object.
struct Call {
  const nlohmann::ordered_json& values;
  const CommandTargets& targets;
  CameraTime now;

  [[nodiscard]] Result<std::uint64_t> count(const char* name) const {
    const std::optional<double> count = number(name);
    if (!count || !(*count >= 0) || *count > 1e9 || *count != std::floor(*count))
      return Status(StatusCode::invalid_argument, "\"" + std::string(name) + "\" must be a whole number from 0 to 1e9");
    return static_cast<std::uint64_t>(*count);
  }
  [[nodiscard]] std::optional<double> number(const char* name) const {
    const auto found = values.find(name);
    return found != values.end() && found->is_number() ? found->get<double>() : std::optional<double>();
  }
  [[nodiscard]] std::optional<std::string> text(const char* name) const {
    const auto found = values.find(name);
    return found != values.end() && found->is_string() ? found->get<std::string>() : std::optional<std::string>();
  }
};

/// An object with the further members of the response, or an error.
using Answer = Result<nlohmann::ordered_json>;

const nlohmann::ordered_json kDone = nlohmann::ordered_json::object();

Answer counters(const Call& call) {
  const Device& device = *call.targets.device;
  nlohmann::ordered_json whole;
  nlohmann::ordered_json& out = whole["counters"];
  for (std::size_t i = 0; i < kOutcomes.size(); ++i)
    out[std::string(kOutcomes[i])] = call.targets.log->count(static_cast<Outcome>(i));
  out["streams"] = device.stream().streams();
  out["controls_set"] = device.controls().sets();
  out["setups"] = device.counts().setups;
  out["stalls"] = device.counts().stalls;
  out["bus_resets"] = device.counts().resets;
  if (call.targets.render_counts) {
    const RenderCounts c = call.targets.render_counts();
    out["rendering"] = {{"rendered", c.rendered},
                        {"kept", c.kept},
                        {"kept_bytes", c.kept_bytes},
                        {"render_s", c.render_s},
                        {"failed", c.failed}};
  }
  return whole;
}

Answer reset_counters(const Call& call) {
  Answer before = counters(call);
  call.targets.log->reset_counts();
  call.targets.device->reset_counts();
  return before;
}

Answer status(const Call& call) {
  const Device& device = *call.targets.device;
  const SensorSettings settings = device.controls().settings();
  nlohmann::ordered_json out = {{"plugged", call.targets.cable->plugged()},
                                {"host", call.targets.cable->host_there()},
                                {"configured", device.configuration() != 0},
                                {"streaming", device.stream().streaming()},
                                {"halted", device.stream().halted()},
                                {"exposure_s", settings.exposure_s},
                                {"gain", settings.gain},
                                {"kelvin", settings.kelvin},
                                {"transfers_waiting", device.stream().waiting_transfers()}};
  if (const auto& agreed = device.stream().negotiated_format()) {
    out["format"] = to_string(agreed->format.encoding);
    out["width"] = agreed->format.size.width;
    out["height"] = agreed->format.size.height;
    out["rate"] = agreed->format.rate;
  }
  out["now_ns"] = call.now.ns;
  return out;
}

Answer frames(const Call& call) {
  const Result<std::uint64_t> last = call.count("last");
  if (!last) return last.status();
  const auto& records = call.targets.log->records();
  const std::size_t from = records.size() - std::min<std::size_t>(records.size(), *last);
  nlohmann::ordered_json out;
  out["frames"] = nlohmann::ordered_json::array();
  for (std::size_t i = from; i < records.size(); ++i) out["frames"].push_back(json_of(records[i]));
  return out;
}

Answer unplug(const Call& call) {
  const std::optional<std::string> how = call.text("how");
  if (call.values.contains("how") && how != "disconnect" && how != "close")
    return Status(StatusCode::invalid_argument, "\"how\" must be \"disconnect\" or \"close\"");
  if (!call.targets.cable->plugged()) return Status(StatusCode::failed_precondition, "the camera is unplugged already");
  call.targets.cable->unplug(how == "close");
  return kDone;
}

Answer plug(const Call& call) {
  if (call.targets.cable->plugged()) return Status(StatusCode::failed_precondition, "the camera is plugged in already");
  call.targets.cable->plug();
  return kDone;
}

Answer stall(const Call& call) {
  call.targets.device->stream().halt(*call.targets.sink);
  return kDone;
}

Answer silence(const Call& call) {
  const std::optional<double> seconds = call.number("seconds");
  if (!seconds || !(*seconds >= 0 && *seconds <= 3600))
    return Status(StatusCode::invalid_argument, "\"seconds\" must be a number from 0 to 3600");
  call.targets.device->stream().faults().silent_until = call.now + Duration::from_seconds(*seconds);
  return kDone;
}

template <std::uint64_t Faults::*kWhich>
Answer fault(const Call& call) {
  const Result<std::uint64_t> frames = call.count("frames");
  if (!frames) return frames.status();
  call.targets.device->stream().faults().*kWhich = *frames;
  return kDone;
}

Answer scene(const Call& call) {
  const std::optional<std::string> uri = call.text("uri");
  if (!uri) return Status(StatusCode::invalid_argument, "\"uri\" must be a text, \"sim:SCENE?...\"");
  if (!call.targets.set_scene)
    return Status(StatusCode::failed_precondition, "the frame source has no scene to replace");
  if (Status set = call.targets.set_scene(*uri); !set.ok()) return set;
  call.targets.device->scene_changed();
  return kDone;
}

Answer help(const Call& call);

struct Command {
  std::string_view name;
  std::vector<std::string_view> values;  ///< Names of the values that it accepts.
  Answer (*run)(const Call&);
};

const std::vector<Command>& commands() {
  static const std::vector<Command> kCommands = {
      {"counters", {}, counters},
      {"frames", {"last"}, frames},
      {"help", {}, help},
      {"mark", {"frames"}, fault<&Faults::mark>},
      {"plug", {}, plug},
      {"reset_counters", {}, reset_counters},
      {"scene", {"uri"}, scene},
      {"shorten", {"frames"}, fault<&Faults::shorten>},
      {"silence", {"seconds"}, silence},
      {"skip", {"frames"}, fault<&Faults::skip>},
      {"stall", {}, stall},
      {"status", {}, status},
      {"tear", {"frames"}, fault<&Faults::tear>},
      {"unplug", {"how"}, unplug},
  };
  return kCommands;
}

Answer help(const Call&) {
  nlohmann::ordered_json out;
  for (const Command& command : commands()) out["commands"][std::string(command.name)] = command.values;
  return out;
}

Answer attempt(std::string_view line, const CommandTargets& targets, CameraTime now) {
  nlohmann::ordered_json values;
  try {
    values = nlohmann::ordered_json::parse(line);
  } catch (const nlohmann::ordered_json::exception& e) {
    return Status(StatusCode::invalid_argument, e.what());
  }
  const Call call{values, targets, now};
  const std::optional<std::string> name = call.text("command");
  if (!name) return Status(StatusCode::invalid_argument, "\"command\" must be a text, for example \"help\"");
  std::vector<std::string_view> known;
  for (const Command& command : commands()) known.push_back(command.name);
  const auto found = std::find(known.begin(), known.end(), *name);
  if (found == known.end()) {
    const std::string near = nearest_name(*name, known);
    return Status(StatusCode::invalid_argument, "no command is called '" + *name + "'" +
                                                    (near.empty() ? "; try help" : ", did you mean '" + near + "'?"));
  }
  const Command& command = commands()[static_cast<std::size_t>(found - known.begin())];
  for (const auto& [key, value] : values.items()) {
    if (key != "command" && std::find(command.values.begin(), command.values.end(), key) == command.values.end())
      return Status(StatusCode::invalid_argument, std::string(command.name) + " has no \"" + key + "\"");
  }
  return command.run(call);
}

}  // namespace

std::string execute_command(std::string_view line, const CommandTargets& targets, CameraTime now) {
  const Answer answer = attempt(line, targets, now);
  nlohmann::ordered_json out;
  out["ok"] = answer.ok();
  if (answer)
    out.update(*answer);
  else
    out["error"] = answer.status().message();
  return json_text(out);
}

}  // namespace lightwell::usb_camera
