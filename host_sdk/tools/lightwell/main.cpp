// lightwell: looks at a probe from the command line.
#include <cstdlib>
#include <string>

#include <CLI/CLI.hpp>

#include <lightwell/probe.hpp>

#include "commands.hpp"
#include "exit_code.hpp"

namespace {

using namespace lightwell::tool;

constexpr const char* kAbout = R"(How a place is lit, as a Lightwell probe sees it.

URI is grpc://HOST:PORT (port 7420 where none is given), grpcs://HOST:PORT for a probe that was
paired with, usb:SERIAL, mqtt://BROKER/TOPIC or replay:FILE, a recording of descriptors, with ?speed=2 twice as
fast, with ?speed=0 as fast as it is read.)";

constexpr const char* kExamples = R"(Examples:
  lightwell watch grpc://probe.local                     a line a second
  lightwell watch grpc://probe.local --seconds 10 --json | tail -1
  lightwell query grpc://probe.local --normal 0,1,0      illuminance of the table
  lightwell query grpc://probe.local --direction 0,0,-1 --roughness 0.4
  lightwell record grpc://probe.local evening.lwr --seconds 60
  lightwell query replay:evening.lwr --lights --json
  lightwell config set grpc://probe.local setting=fast   for all clients of the probe
  lightwell discover                                     which probes there are
  lightwell pair grpcs://probe.local --code 123456       with the code that the probe shows
  lightwell watch grpcs://probe.local                    from then on

A broker that asks is shown what these environment variables name, each a file:
LIGHTWELL_MQTT_CA, _CERTIFICATE, _KEY, and _LOGIN of two lines, user and password. A login goes over
mqtts://; over mqtt:// to another machine only where the address ends in ?security=plain.

Exit codes: 0 ok, 1 nothing was received, 2 usage, 3 unreachable, 4 a file or the probe
refused.)";

constexpr const char* kWatchHelp =
    R"(One line a second, a summary of the whole run at the end (also after Ctrl-C).
  latency  p50 / p99 in ms from the camera handing the frame over, at the probe, to the
           descriptor being readable in this host's SDK
  age      p50 / p99 in ms from mid-exposure to that moment
  clock    how far both may be off, for they compare two clocks

Keys with --json; "second" lines speak of their second, the "summary" of the whole run:
  kind "second" or "summary", seconds, frames, frames_per_s, latency_p50_ms, latency_p99_ms,
  age_p50_ms, age_p99_ms, bytes_p50, bytes_max; of the newest descriptor: lights, band,
  bound (null: infinite), flags, sequence; since the start: gaps, rejected, reconnects;
  clock_uncertainty_ms, state (connecting, connected, waiting, ended). A percentile of
  nothing is null.)";

constexpr const char* kQueryHelp =
    R"(One answer, of the newest descriptor. Directions are in the probe's frame: +Y up, -Z forward;
they need not be normalised. Lux and cd/m2 where the probe's scale is absolute.
  lightwell query URI --normal 0,1,0                 irradiance of a surface that faces up
  lightwell query URI --direction 0,0,-1 --roughness 0.4
  lightwell query URI --lights
A direction is looked up in the probe's environment map; it waits 1.5 s for one, then takes the
harmonics, and says which ("source": map or harmonics).
Keys with --json: quantity, rgb, luminance, unit, lights (included, left_out), validity, age_ms,
bound (null: infinite), flags, of a radiance source; of a light: track, direction, rgb, luminance, unit,
angular_radius_deg, direction_covariance.)";

constexpr const char* kConfigHelp =
    R"(The estimator's configuration, as the probe's file and all clients since made it. It is the same
for all clients, and lasts until lightwelld starts anew.
  lightwell config get grpc://probe.local
  lightwell config get grpc://probe.local --json
  lightwell config set grpc://probe.local setting=fast panorama.epsilon=0.02)";

constexpr const char* kConfigGetHelp =
    R"(A line NAME=VALUE for each field, as `config set` takes them, below a line "# estimator: KIND".
Keys with --json: estimator (panorama, marker), then each field by its name.
Shown are the fields of the estimator that runs. Meanings and limits: proto/lightwell/v1/config.proto.)";

constexpr const char* kConfigSetHelp =
    R"(Each NAME=VALUE is a field as `config get` writes it; what is not named stays as it is. All are set
together or none is; they hold from the next capture on.
  lightwell config set grpc://probe.local panorama.epsilon=0.02
  lightwell config set usb: band=2 max_lights=4 panorama.unseen=mirror
Exit codes: 2 a field or a value that there is not, 3 unreachable, 4 the probe refused.)";

constexpr const char* kDiscoverHelp =
    R"(By multicast DNS, of probes that announce themselves (`discovery` of their configuration), by USB, and
with --broker of probes whose status is retained there, up to three levels below TOPIC. What is shown
is what they say of themselves: anybody on the network can say it.
  lightwell discover --timeout 5
  lightwell discover --broker mqtts://broker/venue --ca venue.pem --login login.txt --json
Keys with --json, an object a probe: found_by (mdns, mqtt, usb), name, id, version, calibration_id,
wire_version (0: not told), instance, host, state (there, gone), links (uri, security none or tls).
Exit code 1: nobody was found, 3: nobody, and a way to look was barred.)";

constexpr const char* kPairHelp =
    R"(On the probe `lightwelld --pair` shows address and code. What is exchanged is of no use to
those who listen or stand between without the code. Kept for this probe: its certificate, which
is asked for from then on whatever its address, a token, and a certificate of this client, whose
key never leaves this machine. They are files in a folder of their own below
$XDG_CONFIG_HOME/lightwell/probes (or ~/.config), for any other client to use.)";

class Program {
 public:
  Program() {
    app_.footer(kExamples);
    app_.require_subcommand(1);
    app_.set_version_flag("--version", std::string(lightwell::version()));
    add_watch();
    add_query();
    add_record();
    add_replay();
    add_info();
    add_config();
    add_discover();
    add_pair();
  }

  int run(int argc, char** argv) {
    try {
      app_.parse(argc, argv);
    } catch (const CLI::Success& success) {
      return app_.exit(success);
    } catch (const CLI::ParseError& error) {
      return fail(kUsage, std::string(error.what()) + "; see lightwell --help");
    }
    return exit_code_;
  }

 private:
  CLI::App* add(const char* name, const char* about) { return app_.add_subcommand(name, about); }
  static void add_uri(CLI::App* command, std::string& uri, std::string& credentials) {
    command
        ->add_option("URI", uri, "grpc://HOST:PORT, grpcs://HOST:PORT, usb:SERIAL, mqtt://BROKER/TOPIC or replay:FILE")
        ->required();
    command->add_option("--credentials", credentials,
                        "Folder that `lightwell pair` made, for a paired probe whose address changed");
  }
  static void add_json(CLI::App* command, Output& output) {
    command->add_flag_callback(
        "--json", [&output] { output = Output::json; }, "JSON, one object a line");
  }
  static void add_seconds(CLI::App* command, double& seconds) {
    command->add_option("--seconds", seconds, "End after so long; without it, at Ctrl-C")->check(CLI::PositiveNumber);
  }

  void add_watch() {
    CLI::App* command = add("watch", "How the link and the light fare, a line a second");
    add_uri(command, watch_.uri, watch_.credentials);
    add_seconds(command, watch_.seconds);
    add_json(command, watch_.output);
    command->add_option("--record", watch_.record, "Write what comes to this file, too");
    command->footer(kWatchHelp);
    command->callback([this] { exit_code_ = run_watch(watch_); });
  }

  void add_query() {
    CLI::App* command = add("query", "How a surface is lit, what a direction looks like, which lights");
    add_uri(command, query_.uri, query_.credentials);
    command->add_option("--normal", query_.normal, "x,y,z: irradiance of a surface that faces there");
    CLI::Option* direction = command->add_option("--direction", query_.direction, "x,y,z: radiance from there");
    command->add_option("--roughness", query_.roughness, "Perceptual, 0 (mirror, lights left out) to 1; default 1")
        ->needs(direction)
        ->check(CLI::Range(0.0, 1.0));
    command->add_flag("--lights", query_.lights, "The discrete lights");
    add_json(command, query_.output);
    command->footer(kQueryHelp);
    command->callback([this] { exit_code_ = run_query(query_); });
  }

  void add_record() {
    CLI::App* command = add("record", "Keep descriptors, byte for byte as received");
    add_uri(command, record_.uri, record_.credentials);
    command->add_option("FILE", record_.file, "New, or a recording to go on with")->required();
    add_seconds(command, record_.seconds);
    command->footer("Example: lightwell record grpc://probe.local evening.lwr --seconds 60");
    command->callback([this] { exit_code_ = run_record(record_); });
  }

  void add_replay() {
    CLI::App* command = add("replay", "What is in a recording, one descriptor a line");
    command->add_option("FILE", replay_.file, "A recording of descriptors")->required();
    add_json(command, replay_.output);
    command->footer(
        "Keys with --json: seconds (since the first), bytes, descriptor (protobuf JSON).\n"
        "To play one at its own pace: lightwell watch replay:FILE");
    command->callback([this] { exit_code_ = run_replay(replay_); });
  }

  void add_info() {
    CLI::App* command = add("info", "Who the probe is, its clock and its counters");
    add_uri(command, info_.uri, info_.credentials);
    add_json(command, info_.output);
    command->add_flag_callback(
        "--no-map", [this] { info_.map = MapInfo::left_out; },
        "Do not wait, up to 1.5 s, to tell of an environment map");
    command->callback([this] { exit_code_ = run_info(info_); });
  }

  void add_config() {
    CLI::App* command = add("config", "Read the estimator's configuration, or change fields of it");
    command->require_subcommand(1);
    command->footer(kConfigHelp);
    CLI::App* get = command->add_subcommand("get", "All fields as they are now");
    add_uri(get, config_get_.uri, config_get_.credentials);
    add_json(get, config_get_.output);
    get->footer(kConfigGetHelp);
    get->callback([this] { exit_code_ = run_config_get(config_get_); });
    CLI::App* set = command->add_subcommand("set", "Change some fields and leave the others as they are");
    add_uri(set, config_set_.uri, config_set_.credentials);
    set->add_option("NAME=VALUE", config_set_.fields, "Fields to change, as `config get` writes them")->required();
    set->footer(kConfigSetHelp);
    set->callback([this] { exit_code_ = run_config_set(config_set_); });
  }

  void add_discover() {
    CLI::App* command = add("discover", "Which probes there are, their versions, calibrations and links");
    command->add_option("--timeout", discover_.timeout, "Seconds to look [2]")->check(CLI::PositiveNumber);
    CLI::Option* broker =
        command->add_option("--broker", discover_.broker, "mqtt://BROKER or mqtt://BROKER/TOPIC: look there, too");
    command->add_option("--ca", discover_.ca_file, "Authorities of the broker's certificate, PEM [the system's]")
        ->needs(broker);
    command->add_option("--login", discover_.login_file, "File with user name and password, a line each")
        ->needs(broker);
    add_json(command, discover_.output);
    command->footer(kDiscoverHelp);
    command->callback([this] { exit_code_ = run_discover(discover_); });
  }

  void add_pair() {
    CLI::App* command = add("pair", "Make a probe and this machine known to each other");
    command->add_option("URI", pair_.uri, "grpcs://HOST:PORT that the probe shows (port 7421 where none is given)")
        ->required();
    command->add_option("--code", pair_.code, "The six digits that the probe shows; without it, from stdin");
    command->add_option("--name", pair_.name, "Under what the probe lists this client [the host's name]");
    command->add_option("--store", pair_.store, "Folder to keep it below, in place of the default");
    add_json(command, pair_.output);
    command->footer(kPairHelp);
    command->callback([this] { exit_code_ = run_pair(pair_); });
  }

  CLI::App app_{kAbout, "lightwell"};
  WatchOptions watch_;
  QueryOptions query_;
  RecordOptions record_;
  ReplayOptions replay_;
  InfoOptions info_;
  ConfigGetOptions config_get_;
  ConfigSetOptions config_set_;
  DiscoverCommand discover_;
  PairCommand pair_;
  int exit_code_ = kOk;
};

}  // namespace

int main(int argc, char** argv) {
  // What gRPC would write to stderr we say ourselves, in words; whoever wants both sets the variable.
  setenv("GRPC_VERBOSITY", "NONE", 0);
  return Program().run(argc, argv);
}
