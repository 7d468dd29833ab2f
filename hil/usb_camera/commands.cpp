#include "usb_camera/commands.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <lightwell/json.hpp>

#include "imaging/uri.hpp"

namespace lightwell::usb_camera {

namespace {

/// A command with its parsed values.
struct Call {
  const JsonObject& values;
  const CommandTargets& targets;
  CameraTime now;

  [[nodiscard]] Result<std::uint64_t> count(std::string_view name) const {
    const auto found = values.find(name);
    const double* const number = found == values.end() ? nullptr : std::get_if<double>(&found->second);
    if (number == nullptr || !(*number >= 0) || *number > 1e9 || *number != std::floor(*number))
      return Status(StatusCode::invalid_argument, "\"" + std::string(name) + "\" must be a whole number from 0 to 1e9");
    return static_cast<std::uint64_t>(*number);
  }
};

/// Further members of the response as text, ", \"name\": value", or an error.
using Answer = Result<std::string>;

std::string counters_json(const Call& call) {
  const Device& device = *call.targets.device;
  std::string out = "{";
  for (const std::string_view& name : kOutcomes) {
    const auto outcome = static_cast<Outcome>(&name - kOutcomes.data());
    out += json_string(name) + ": " + std::to_string(call.targets.log->count(outcome)) + ", ";
  }
  out += "\"streams\": " + std::to_string(device.stream().streams());
  out += ", \"controls_set\": " + std::to_string(device.controls().sets());
  out += ", \"setups\": " + std::to_string(device.counts().setups);
  out += ", \"stalls\": " + std::to_string(device.counts().stalls);
  out += ", \"bus_resets\": " + std::to_string(device.counts().resets);
  if (call.targets.rendering) out += ", \"rendering\": " + call.targets.rendering();
  return out + "}";
}

Answer counters(const Call& call) { return ", \"counters\": " + counters_json(call); }

Answer reset_counters(const Call& call) {
  std::string before = ", \"counters\": " + counters_json(call);
  call.targets.log->reset_counts();
  call.targets.device->reset_counts();
  return before;
}

Answer status(const Call& call) {
  const Device& device = *call.targets.device;
  const SensorSettings settings = device.controls().settings();
  std::array<char, 160> sensor{};
  std::snprintf(sensor.data(), sensor.size(), "\"exposure_s\": %.9g, \"gain\": %.6g, \"kelvin\": %d",
                settings.exposure_s, settings.gain, settings.kelvin);
  const auto truth = [](bool b) { return b ? std::string("true") : std::string("false"); };
  std::string out = ", \"plugged\": " + truth(call.targets.cable->plugged()) +
                    ", \"host\": " + truth(call.targets.cable->host_there()) +
                    ", \"configured\": " + truth(device.configuration() != 0) +
                    ", \"streaming\": " + truth(device.stream().streaming()) +
                    ", \"halted\": " + truth(device.stream().halted()) + ", " + sensor.data() +
                    ", \"transfers_waiting\": " + std::to_string(device.stream().waiting_transfers());
  if (const auto& agreed = device.stream().negotiated_format()) {
    out += ", \"format\": " + json_string(to_string(agreed->format.encoding)) +
           ", \"width\": " + std::to_string(agreed->format.size.width) +
           ", \"height\": " + std::to_string(agreed->format.size.height) +
           ", \"rate\": " + std::to_string(agreed->format.rate);
  }
  return out + ", \"now_ns\": " + std::to_string(call.now.ns);
}

Answer frames(const Call& call) {
  const Result<std::uint64_t> last = call.count("last");
  if (!last) return last.status();
  const auto& records = call.targets.log->records();
  const std::size_t from = records.size() - std::min<std::size_t>(records.size(), *last);
  std::string out = ", \"frames\": [";
  for (std::size_t i = from; i < records.size(); ++i) out += (i > from ? ", " : "") + to_json(records[i]);
  return out + "]";
}

Answer unplug(const Call& call) {
  const auto how = call.values.find("how");
  const auto* const text = how == call.values.end() ? nullptr : std::get_if<std::string>(&how->second);
  if (how != call.values.end() && (text == nullptr || (*text != "disconnect" && *text != "close")))
    return Status(StatusCode::invalid_argument, "\"how\" must be \"disconnect\" or \"close\"");
  if (!call.targets.cable->plugged()) return Status(StatusCode::failed_precondition, "the camera is unplugged already");
  call.targets.cable->unplug(text != nullptr && *text == "close");
  return std::string();
}

Answer plug(const Call& call) {
  if (call.targets.cable->plugged()) return Status(StatusCode::failed_precondition, "the camera is plugged in already");
  call.targets.cable->plug();
  return std::string();
}

Answer stall(const Call& call) {
  call.targets.device->stream().halt(*call.targets.sink);
  return std::string();
}

Answer silence(const Call& call) {
  const auto found = call.values.find("seconds");
  const double* const seconds = found == call.values.end() ? nullptr : std::get_if<double>(&found->second);
  if (seconds == nullptr || !(*seconds >= 0 && *seconds <= 3600))
    return Status(StatusCode::invalid_argument, "\"seconds\" must be a number from 0 to 3600");
  call.targets.device->stream().faults().silent_until = call.now + Duration::from_seconds(*seconds);
  return std::string();
}

template <std::uint64_t Faults::*kWhich>
Answer fault(const Call& call) {
  const Result<std::uint64_t> frames = call.count("frames");
  if (!frames) return frames.status();
  call.targets.device->stream().faults().*kWhich = *frames;
  return std::string();
}

Answer scene(const Call& call) {
  const auto found = call.values.find("uri");
  const auto* const uri = found == call.values.end() ? nullptr : std::get_if<std::string>(&found->second);
  if (uri == nullptr) return Status(StatusCode::invalid_argument, "\"uri\" must be a text, \"sim:SCENE?...\"");
  if (!call.targets.set_scene)
    return Status(StatusCode::failed_precondition, "the frame source has no scene to replace");
  if (Status set = call.targets.set_scene(*uri); !set.ok()) return set;
  call.targets.device->scene_changed();
  return std::string();
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
  std::string out = ", \"commands\": {";
  for (const Command& command : commands()) {
    out += (&command == commands().data() ? "" : ", ") + json_string(command.name) + ": [";
    for (const std::string_view& value : command.values)
      out += (&value == command.values.data() ? "" : ", ") + json_string(value);
    out += "]";
  }
  return out + "}";
}

Answer attempt(std::string_view line, const CommandTargets& targets, CameraTime now) {
  const Result<JsonObject> values = parse_json_object(line);
  if (!values) return values.status();
  const auto named = values->find("command");
  const auto* const name = named == values->end() ? nullptr : std::get_if<std::string>(&named->second);
  std::vector<std::string_view> known;
  for (const Command& command : commands()) known.push_back(command.name);
  if (name == nullptr) return Status(StatusCode::invalid_argument, "\"command\" must be a text, for example \"help\"");
  const auto found = std::find(known.begin(), known.end(), *name);
  if (found == known.end()) {
    const std::string near = nearest_name(*name, known);
    return Status(StatusCode::invalid_argument, "no command is called '" + *name + "'" +
                                                    (near.empty() ? "; try help" : ", did you mean '" + near + "'?"));
  }
  const Command& command = commands()[static_cast<std::size_t>(found - known.begin())];
  for (const auto& [key, value] : *values) {
    if (key != "command" && std::find(command.values.begin(), command.values.end(), key) == command.values.end())
      return Status(StatusCode::invalid_argument, std::string(command.name) + " has no \"" + key + "\"");
  }
  return command.run({*values, targets, now});
}

}  // namespace

std::string execute_command(std::string_view line, const CommandTargets& targets, CameraTime now) {
  const Answer answer = attempt(line, targets, now);
  if (answer) return "{\"ok\": true" + *answer + "}";
  return "{\"ok\": false, \"error\": " + json_string(answer.status().message()) + "}";
}

}  // namespace lightwell::usb_camera
