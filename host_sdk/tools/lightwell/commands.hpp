// The tool's commands: what each was asked for, and the function that does it.
#pragma once

#include <optional>
#include <string>

namespace lightwell::tool {

enum class Output { text, json };

struct WatchOptions {
  std::string uri;
  double seconds = 0;  ///< 0: until it ends or is interrupted.
  std::string record;  ///< Empty: none.
  Output output = Output::text;
};
int run_watch(const WatchOptions& options);

struct QueryOptions {
  std::string uri;
  std::string normal, direction;  ///< "x,y,z", or empty.
  double roughness = 1;
  bool lights = false;
  Output output = Output::text;
};
int run_query(const QueryOptions& options);

struct RecordOptions {
  std::string uri, file;
  double seconds = 0;
};
int run_record(const RecordOptions& options);

struct ReplayOptions {
  std::string file;
  Output output = Output::text;
};
int run_replay(const ReplayOptions& options);

struct InfoOptions {
  std::string uri;
  Output output = Output::text;
};
int run_info(const InfoOptions& options);

}  // namespace lightwell::tool
