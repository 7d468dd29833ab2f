// The tool's commands: options, and the function that runs each.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace lightwell::tool {

enum class Output { text, json };

struct WatchOptions {
  std::string uri;
  std::string credentials;  ///< Folder; empty: looked up.
  double seconds = 0;       ///< 0: until the recording ends or the tool is interrupted.
  std::string record;       ///< Empty: none.
  Output output = Output::text;
};
int run_watch(const WatchOptions& options);

struct QueryOptions {
  std::string uri;
  std::string credentials;        ///< Folder; empty: looked up.
  std::string normal, direction;  ///< "x,y,z", or empty.
  double roughness = 1;
  bool lights = false;
  Output output = Output::text;
};
int run_query(const QueryOptions& options);

struct RecordOptions {
  std::string uri, file;
  std::string credentials;
  double seconds = 0;
};
int run_record(const RecordOptions& options);

struct ReplayOptions {
  std::string file;
  Output output = Output::text;
};
int run_replay(const ReplayOptions& options);

/// Whether `info` includes the environment map, for which it may have to wait.
enum class MapInfo : std::uint8_t { included, left_out };

struct InfoOptions {
  std::string uri;
  std::string credentials;  ///< Folder; empty: looked up.
  Output output = Output::text;
  MapInfo map = MapInfo::included;
};
int run_info(const InfoOptions& options);

struct ConfigGetOptions {
  std::string uri;
  std::string credentials;  ///< Folder; empty: looked up.
  Output output = Output::text;
};
int run_config_get(const ConfigGetOptions& options);

struct ConfigSetOptions {
  std::string uri;
  std::string credentials;          ///< Folder; empty: looked up.
  std::vector<std::string> fields;  ///< "name=value".
};
int run_config_set(const ConfigSetOptions& options);

struct DiscoverCommand {
  double timeout = 2;
  std::string broker, ca_file, login_file;  ///< Empty: none.
  Output output = Output::text;
};
int run_discover(const DiscoverCommand& command);

struct PairCommand {
  std::string uri, code;    ///< Empty code: read from stdin.
  std::string name, store;  ///< Empty: the SDK's defaults.
  Output output = Output::text;
};
int run_pair(const PairCommand& command);

}  // namespace lightwell::tool
