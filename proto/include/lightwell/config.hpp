// lightwelld's configuration as a value. Meanings and defaults: proto/lightwell/v1/config.proto.
#pragma once

#include <lightwell/result.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace lightwell {

struct CameraConfig {
  std::string uri;
  int width = 640;
  int height = 480;
  double frame_rate = 30;
  std::vector<double> exposure_s;  ///< Empty: what the camera starts with.
  double gain = 1;
};

struct EstimatorConfig {
  int band = 4;
  int max_lights = 8;
  double light_threshold = 6;

  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

struct Config {
  std::string probe_name = "lightwell";
  CameraConfig camera;
  std::string calibration;
  EstimatorConfig estimator;
  std::string grpc_listen = "127.0.0.1:7420";
  std::string record_path;

  [[nodiscard]] Status validate() const;
};

/// Reads a Config in protobuf text format. Errors name file, line and, for an unknown field, the nearest known one.
[[nodiscard]] Result<Config> load_config(const std::string& path);
/// The same from memory; `name` stands for the file in messages.
[[nodiscard]] Result<Config> parse_config(std::string_view text, const std::string& name);

}  // namespace lightwell
