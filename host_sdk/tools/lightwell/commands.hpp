// The tool's options, and the functions that run its commands.
#pragma once

#include <string>
#include <vector>

namespace lightwell::tool {

/// The options of all commands. Empty texts: not given.
struct Options {
  std::string uri;
  std::string credentials;  ///< Folder; empty: looked up.
  bool json = false;
  double seconds = 0;             ///< watch, record; 0: until the recording ends or the tool is interrupted.
  std::string file;               ///< watch, record: to write; replay: to read.
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
int run_discover(const Options& options);
int run_pair(const Options& options);

}  // namespace lightwell::tool
