// lightwell: command line tool for probes.
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <unistd.h>
#include <vector>

#include <CLI/CLI.hpp>

#include "common.hpp"

namespace {

using namespace lightwell::tool;

constexpr const char* kAbout = R"(The lighting at a place, as measured by a Lightwell probe.

URI is grpc://HOST:PORT (default port 7420), grpcs://HOST:PORT for a paired probe, ws://HOST:PORT
(default port 7443) and wss:// for its web link, usb:SERIAL, mqtt://BROKER/TOPIC or replay:FILE, a
recording of descriptors; ?speed=2 plays it twice as fast, ?speed=0 as fast as it can be read.)";

constexpr const char* kExamples = R"(Examples:
  lightwell watch grpc://probe.local                     one line per second
  lightwell watch grpc://probe.local --seconds 10 --json | tail -1
  lightwell query grpc://probe.local --normal 0,1,0      illuminance of the table
  lightwell query grpc://probe.local --direction 0,0,-1 --roughness 0.4
  lightwell record grpc://probe.local evening.lwr --seconds 60
  lightwell query replay:evening.lwr --lights --json
  lightwell config set grpc://probe.local setting=fast   for all clients of the probe
  lightwell recording start grpc://probe.local           a recording on the probe's own disk
  lightwell discover                                     lists the available probes
  lightwell doctor grpcs://probe.local                   checks this machine and the way to the probe
  lightwell field mqtt://broker/venue/+                  lights in space, from all probes of a venue
  lightwell pair grpcs://probe.local --code 123456       with the code that the probe shows
  lightwell watch grpcs://probe.local                    after pairing

Credentials for an MQTT broker are files, whose paths are in these environment variables:
LIGHTWELL_MQTT_CA, _CERTIFICATE, _KEY, and _LOGIN with two lines, user and password. A login is sent over
mqtts://; over mqtt:// to another machine only if the address ends in ?security=plain.

Exit codes: 0 ok, 1 nothing was received, 2 usage, 3 unreachable, 4 error of a file, or refused by
the probe.)";

constexpr const char* kWatchHelp =
    R"(One line per second, and a summary of the whole run at the end (also after Ctrl-C).
  latency  p50 / p99 in ms from delivery of the frame by the probe's camera until the descriptor
           is available in this host's SDK
  age      p50 / p99 in ms from mid-exposure until then
  clock    maximum error of both, because they compare two clocks

Keys with --json; "second" lines are for one second, the "summary" is for the whole run:
  kind "second" or "summary", seconds, frames, frames_per_s, latency_p50_ms, latency_p99_ms,
  age_p50_ms, age_p99_ms, bytes_p50, bytes_max; of the newest descriptor: lights, band,
  bound (null: infinite), flags, sequence; since the start: gaps, rejected, reconnects;
  clock_uncertainty_ms, state (connecting, connected, waiting, ended, gone). A percentile
  without data is null.)";

constexpr const char* kQueryHelp =
    R"(One query of the newest descriptor. Directions are in the probe's frame: +Y up, -Z forward;
they need not be normalised. Lux and cd/m2 if the probe's units are absolute.
  lightwell query URI --normal 0,1,0                 irradiance of a surface that faces up
  lightwell query URI --direction 0,0,-1 --roughness 0.4
  lightwell query URI --lights
Radiance comes from the probe's environment map; without a map within 1.5 s it comes from the
harmonics. "source" is map or harmonics.
Keys with --json: quantity, rgb, luminance, unit, lights (included, left_out), validity, age_ms,
bound (null: infinite), flags; of a radiance also source; of a light: track, direction, rgb, luminance, unit,
angular_radius_deg, direction_covariance, of a near lamp also distance_m, distance_sigma_m (standard deviation),
position. --lights of a marker begins with its origin, the point at which its light holds: position (m), orientation
(x, y, z, w). All are in the probe's frame.)";

constexpr const char* kConfigHelp =
    R"(The estimator's configuration: the probe's file with the changes of all clients. It is the same
for all clients, and is kept until lightwelld restarts.
  lightwell config get grpc://probe.local --json
  lightwell config set grpc://probe.local setting=fast panorama.epsilon=0.02)";

constexpr const char* kConfigGetHelp =
    R"(A line NAME=VALUE for each field, as accepted by `config set`, after a line "# estimator: KIND".
Keys with --json: estimator (panorama, marker, specular), then each field by its name.
The fields are those of the active estimator. Meanings and limits: proto/lightwell/v1/config.proto.)";

constexpr const char* kConfigSetHelp =
    R"(Each NAME=VALUE is a field as `config get` prints it; other fields are not changed. Either all are
set or none; they take effect with the next capture.
  lightwell config set usb: band=2 max_lights=4 panorama.unseen_fill=mirror
Exit codes: 2 unknown field or value, 3 unreachable, 4 refused by the probe.)";

constexpr const char* kCalibrationHelp =
    R"(What the probe's calibration covers, and how well; it does not change while the probe runs.
Keys with --json: id, file (empty: the camera's own), absolute (cd/m2 are known), lenses (width, height,
model, max_angle_deg, response, vignetting, noise); report, if lightwell-calibrate wrote one:
geometry_time_s, photometry_time_s (seconds since 1970, 0: not known), rms_px, points, seen_deg and
direction_3_sigma_deg of each lens.)";

constexpr const char* kRecordingHelp =
    R"(A recording by the probe itself, of all descriptors as it sends them, in the folder that its owner
has configured (recordings { folder: "..." }, lightwelld --recordings). The probe chooses the name; the
file stays there. With a captured plane whose images all clients receive, also of that plane.
`lightwell record` writes a file on this machine instead.
  lightwell recording start grpc://probe.local
  lightwell recording status grpc://probe.local --json
  lightwell recording stop grpc://probe.local
Keys with --json: running, file, bytes, descriptors, lost (messages that the probe's disk was too slow
for), end_reason (why it ended, if no client stopped it), faults (recordings that ended so).
Exit codes: 3 unreachable, 4 refused by the probe.)";

constexpr const char* kDiscoverHelp =
    R"(Finds probes by multicast DNS (if `discovery` of their configuration is on), on USB, and, with
--broker, by their status retained at a broker, up to three levels below TOPIC. The output is what the
network reports and is not authenticated.
  lightwell discover --timeout 5
  lightwell discover --broker mqtts://broker/venue --ca venue.pem --login login.txt --json
Keys with --json, one object per probe: found_by (mdns, mqtt, usb), name, id, version, calibration_id,
wire_version (0: unknown), instance, host, state (there, gone), links (uri, security none or tls).
Exit code 1: no probe was found, 3: no probe was found, and a method failed.)";

constexpr const char* kDoctorHelp =
    R"(Checks what is needed to receive light, one line for each check: its verdict, its name, what was
found, and after "->" what to do. Without URI: what this machine can do, and which probes are announced. With
URI also every step to that probe: name, connection, TLS, access, versions, frames and their age, clock,
losses, the probe's own faults.
  lightwell doctor
  lightwell doctor grpcs://probe.local
Verdicts: ok; warning (works, or may); fault (does not work); not checked (it cannot be checked here, or
does not apply; the line says why). A check that takes longer than 2 s says so on stderr; each ends after
20 s at most.
Keys with --json, one object per check: check, verdict, found, remedy.
Exit codes: 0 no fault (there may be warnings), otherwise of the first fault: 1 no descriptor arrives,
2 usage, 3 the probe cannot be reached, 4 anything else, also a refused certificate or token.)";

constexpr const char* kPairHelp =
    R"(On the probe, `lightwelld --pair` shows address and code. Eavesdroppers, and a man in the middle
without the code, learn nothing. Stored for this probe: its certificate, which is required from then
on whatever its address is, a token, and a certificate of this client, whose key never leaves this
machine. They are files in a folder per probe below
$XDG_CONFIG_HOME/lightwell/probes (or ~/.config), for any other client to use.)";

/// Runs the program of that name in the folder of this one, in its place.
[[noreturn]] void run_program(const std::string& name, const std::vector<std::string>& arguments) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string path = (self.parent_path() / name).string();
  std::vector<char*> words{const_cast<char*>(name.c_str())};
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  execv(path.c_str(), words.data());
  fail(kFile, "cannot run " + path + ": " + std::generic_category().message(errno) +
                  "; it is built and installed where Ceres (libceres-dev) is found");
}

/// Adds the commands, whose callbacks run them with `options` and set `exit_code`.
void add_commands(CLI::App& app, Options& options, int& exit_code) {
  const auto add = [&](CLI::App& parent, const char* name, const char* about, int (*run)(const Options&),
                       const char* footer) {
    CLI::App* command = parent.add_subcommand(name, about);
    command->footer(footer);
    command->callback([&options, &exit_code, run] { exit_code = run(options); });
    return command;
  };
  const auto add_optional_uri = [&](CLI::App* command) {
    command->add_option("--credentials", options.credentials,
                        "Folder that `lightwell pair` made, for a paired probe whose address changed");
    return command->add_option(
        "URI", options.uri, "grpc(s)://HOST:PORT, ws(s)://HOST:PORT, usb:SERIAL, mqtt://BROKER/TOPIC or replay:FILE");
  };
  const auto add_uri = [&](CLI::App* command) { add_optional_uri(command)->required(); };
  const auto add_json = [&](CLI::App* command) {
    command->add_flag("--json", options.json, "JSON, one object per line");
  };
  const auto add_seconds = [&](CLI::App* command) {
    command->add_option("--seconds", options.seconds, "Duration; without it, until Ctrl-C")->check(CLI::PositiveNumber);
  };

  CLI::App* watch =
      add(app, "watch", "Statistics of the link and the lighting, one line per second", run_watch, kWatchHelp);
  add_uri(watch);
  add_seconds(watch);
  add_json(watch);
  watch->add_option("--record", options.file, "Also write the descriptors to this file");

  CLI::App* query =
      add(app, "query", "Irradiance of a surface, radiance from a direction, discrete lights", run_query, kQueryHelp);
  add_uri(query);
  query->add_option("--normal", options.normal, "x,y,z: irradiance of a surface with this normal");
  CLI::Option* direction = query->add_option("--direction", options.direction, "x,y,z: radiance from this direction");
  query->add_option("--roughness", options.roughness, "Perceptual, 0 (mirror, lights left out) to 1; default 1")
      ->needs(direction)
      ->check(CLI::Range(0.0, 1.0));
  query->add_flag("--lights", options.lights, "The discrete lights");
  add_json(query);

  CLI::App* record = add(app, "record", "Write descriptors to a file, byte for byte as received", run_record,
                         "Example: lightwell record grpc://probe.local evening.lwr --seconds 60\n"
                         "A recording with --plane is refused by readers that know no planes. It holds the texture,\n"
                         "which is a photograph, if the probe sends it (`images` of its configuration).\n"
                         "With --mcap the messages are in the topics lightwell/descriptor and lightwell/plane, with\n"
                         "their protobuf schemas; publish_time is the middle of the exposure, log_time the reception,\n"
                         "both UTC. A recording is converted by: lightwell record replay:evening.lwr?speed=0 "
                         "evening.mcap --mcap");
  add_uri(record);
  record->add_option("FILE", options.file, "New file, or a recording to continue")->required();
  record->add_flag("--plane", options.plane, "Also the captured planes of the probe");
  record->add_flag("--mcap", options.mcap, "A new MCAP file, which other programs' viewers open; it holds the schema");
  add_seconds(record);

  CLI::App* replay = add(app, "replay", "Content of a recording, one message per line", run_replay,
                         "Keys with --json: seconds (since the first), bytes, descriptor (protobuf JSON);\n"
                         "of a captured plane: plane (capture, revision, tiles, texture_edge).\n"
                         "To play one at its original speed: lightwell watch replay:FILE");
  replay->add_option("FILE", options.file, "A recording of descriptors")->required();
  add_json(replay);

  CLI::App* info = add(app, "info", "Identity, clock and counters of the probe", run_info, kExamples);
  add_uri(info);
  add_json(info);
  info->add_flag("--no-map", options.no_map, "Do not wait up to 1.5 s for an environment map");

  CLI::App* config = app.add_subcommand("config", "Read or change the estimator's configuration");
  config->require_subcommand(1);
  config->footer(kConfigHelp);
  CLI::App* get = add(*config, "get", "Print all fields", run_config_get, kConfigGetHelp);
  add_uri(get);
  add_json(get);
  CLI::App* set = add(*config, "set", "Change some fields, keep the others", run_config_set, kConfigSetHelp);
  add_uri(set);
  set->add_option("NAME=VALUE", options.fields, "Fields to change, as `config get` prints them")->required();

  CLI::App* calibration =
      add(app, "calibration", "What the probe's calibration covers, and how well", run_calibration, kCalibrationHelp);
  add_uri(calibration);
  add_json(calibration);

  CLI::App* recording = app.add_subcommand("recording", "Start or stop a recording by the probe, on its own disk");
  recording->require_subcommand(1);
  recording->footer(kRecordingHelp);
  for (CLI::App* command :
       {add(*recording, "start", "Start a recording on the probe", run_recording_start, kRecordingHelp),
        add(*recording, "stop", "Stop the recording on the probe", run_recording_stop, kRecordingHelp),
        add(*recording, "status", "State of the recording on the probe", run_recording_status, kRecordingHelp)}) {
    add_uri(command);
    add_json(command);
  }

  CLI::App* discover =
      add(app, "discover", "List available probes with versions, calibrations and links", run_discover, kDiscoverHelp);
  discover->add_option("--timeout", options.timeout, "Duration of the search, seconds [2]")->check(CLI::PositiveNumber);
  CLI::Option* broker =
      discover->add_option("--broker", options.broker, "mqtt://BROKER or mqtt://BROKER/TOPIC: also search there");
  discover
      ->add_option("--ca", options.ca_file,
                   "Certification authorities for the broker's certificate, PEM [the system's]")
      ->needs(broker);
  discover->add_option("--login", options.login_file, "File with two lines, user name and password")->needs(broker);
  add_json(discover);

  CLI::App* doctor =
      add(app, "doctor", "Check this machine, and the way to a probe; says what to do", run_doctor, kDoctorHelp);
  add_optional_uri(doctor);
  add_json(doctor);

  CLI::App* field = app.add_subcommand("field", "Lights in space, from several probes (the program lightwell-field)");
  // All that follows, --help too, is for the other program.
  field->prefix_command();
  field->set_help_flag();
  field->callback([field] { run_program("lightwell-field", field->remaining()); });

  CLI::App* pair = add(app, "pair", "Pair a probe with this machine", run_pair, kPairHelp);
  pair->add_option("URI", options.uri, "grpcs://HOST:PORT that the probe shows (default port 7421)")->required();
  pair->add_option("--code", options.code, "The six digits that the probe shows; without it, read from stdin");
  pair->add_option("--name", options.name, "Name of this client in the probe's list [the host name]");
  pair->add_option("--store", options.store, "Folder of the credential store, instead of the default");
  add_json(pair);
}

}  // namespace

int main(int argc, char** argv) {
  // Silence gRPC's own messages on stderr, because the tool reports errors; a variable that is set is kept.
  setenv("GRPC_VERBOSITY", "NONE", 0);
  CLI::App app{kAbout, "lightwell"};
  app.footer(kExamples);
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string(lightwell::version()));
  Options options;
  int exit_code = kOk;
  add_commands(app, options, exit_code);
  const int parsed = parse(app, argc, argv);
  return parsed == kOk ? exit_code : parsed;
}
