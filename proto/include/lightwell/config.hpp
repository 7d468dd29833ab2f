// lightwelld's configuration as a value. Meanings and defaults: proto/lightwell/v1/config.proto.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/mqtt.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

struct CameraConfig {
  std::string uri;
  int width = 640;
  int height = 480;
  double frame_rate = 30;
  std::vector<double> exposure_s;  ///< Empty: what the camera starts with.
  double gain = 1;
};

/// What stands in for directions that no pixel sees.
enum class UnseenFill : std::uint8_t {
  none = 1,     ///< Dark.
  mirror = 2,   ///< The direction mirrored at the plane that bounds what is seen.
  average = 3,  ///< The running mean of when it was seen; dark where it never was.
};

enum class Smoothing : std::uint8_t { none = 1, one_euro = 2 };

/// What light is read from. Each kind has a message of options of its own in EstimatorConfig, of the same name.
enum class EstimatorKind : std::uint8_t { panorama = 1, marker = 2 };
[[nodiscard]] std::string_view to_string(EstimatorKind kind);

/// Of the panorama estimator alone. Meanings and defaults: config.proto.
struct PanoramaEstimatorConfig {
  double light_threshold = 6;
  double epsilon = 0.01;
  double radiance_epsilon = 0;
  UnseenFill unseen = UnseenFill::none;
  Smoothing smoothing = Smoothing::one_euro;
  int environment_edge = 0;
  double environment_rate = 5;

  [[nodiscard]] Status validate() const;
  friend bool operator==(const PanoramaEstimatorConfig&, const PanoramaEstimatorConfig&) = default;
};

/// Of the marker estimator alone. Meanings and defaults: config.proto.
struct MarkerEstimatorConfig {
  double decimation = 0;
  double search_decimation = 1.5;
  int max_faces = 0;

  [[nodiscard]] Status validate() const;
  friend bool operator==(const MarkerEstimatorConfig&, const MarkerEstimatorConfig&) = default;
};

/// Meanings and defaults: config.proto.
struct EstimatorConfig {
  int band = 6;
  int max_lights = 16;
  Setting setting = Setting::balanced;
  PanoramaEstimatorConfig panorama{};
  MarkerEstimatorConfig marker{};

  /// Of the values alone. invalid_argument names the field.
  [[nodiscard]] Status validate() const;
  /// And that the estimator of this kind has all that is set to other than its default. invalid_argument names the
  /// first field that it lacks, and which estimator has it.
  [[nodiscard]] Status validate(EstimatorKind kind) const;
  friend bool operator==(const EstimatorConfig&, const EstimatorConfig&) = default;
};

/// The options that an estimator of this kind has, in the order of config.proto: "band", "panorama.epsilon", ...
[[nodiscard]] std::vector<std::string> option_names(EstimatorKind kind);
/// Those of Setting that differ in what it does.
[[nodiscard]] std::span<const Setting> settings_of(EstimatorKind kind);

/// Some fields of an EstimatorConfig: those that have a value.
struct EstimatorUpdate {
  struct Panorama {
    std::optional<double> light_threshold{};
    std::optional<double> epsilon{};
    std::optional<double> radiance_epsilon{};
    std::optional<UnseenFill> unseen{};
    std::optional<Smoothing> smoothing{};
    std::optional<int> environment_edge{};
    std::optional<double> environment_rate{};

    friend bool operator==(const Panorama&, const Panorama&) = default;
  };
  struct Marker {
    std::optional<double> decimation{};
    std::optional<double> search_decimation{};
    std::optional<int> max_faces{};

    friend bool operator==(const Marker&, const Marker&) = default;
  };

  std::optional<int> band{};
  std::optional<int> max_lights{};
  std::optional<Setting> setting{};
  Panorama panorama{};
  Marker marker{};

  friend bool operator==(const EstimatorUpdate&, const EstimatorUpdate&) = default;
};

/// `config` with the fields that `update` has. They are not checked.
[[nodiscard]] EstimatorConfig updated(EstimatorConfig config, const EstimatorUpdate& update);
/// With which updated() makes `config` of any other.
[[nodiscard]] EstimatorUpdate all_fields(const EstimatorConfig& config);

/// The estimator that runs.
struct EstimatorState {
  EstimatorKind kind = EstimatorKind::panorama;
  EstimatorConfig config{};
};

/// An option as text, by the name that option_names() has for it: "panorama.epsilon" is "0.01".
struct ConfigField {
  enum class Type : std::uint8_t { number, word };
  std::string name, value;
  Type type = Type::number;
};
/// All that this estimator has, in the order of option_names().
[[nodiscard]] std::vector<ConfigField> fields_of(const EstimatorState& estimator);
/// Puts one field into `update`: name and value as fields_of() writes them. invalid_argument names the nearest field,
/// or the values that there are; limits are not checked.
[[nodiscard]] Status set_field(EstimatorUpdate& update, std::string_view name, std::string_view value);

/// `config` with the limits of error that its setting makes of the panorama's: twice as wide at fast, none left at
/// exact, so that all that was found is sent.
[[nodiscard]] EstimatorConfig config_for_setting(EstimatorConfig config);

/// A matte grey surface in view. It must lie in the light that the probe measures.
struct GreyPatch {
  int lens = 0;
  int x = 0, y = 0, width = 0, height = 0;  ///< Pixels of that lens, all on the patch.
  Vec3f normal{0, 1, 0};                    ///< Unit, probe frame.
  double albedo = 0.18;

  /// Of itself, and of the picture it must lie in. invalid_argument names the field.
  [[nodiscard]] Status validate(const RigParameters& rig) const;
};

/// Light from a marker that the camera looks at.
struct MarkerConfig {
  std::string body;  ///< Path of a MarkerBody.
};

struct UsbGadgetConfig {
  std::string ffs = "/dev/ffs-lightwell";  ///< Where FunctionFS is mounted.
};

enum class LinkSecurity : std::uint8_t { unspecified = 0, plain = 1, tls = 2, mutual_tls = 3 };

/// Meanings: config.proto. Paths are empty where there is none.
struct MqttConfig {
  std::string uri;
  std::string ca_file{}, certificate_file{}, key_file{}, login_file{};
  std::string client_id{};  ///< Empty: "lightwell-" and the probe's name.
  LinkSecurity security = LinkSecurity::unspecified;

  /// The address of `uri`, with what `security` allows. invalid_argument as validate().
  [[nodiscard]] Result<MqttAddress> address() const;
  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

/// Whether a probe is announced by multicast DNS.
enum class Mdns : std::uint8_t { off = 1, on = 2 };

/// The network link. Meanings and defaults: config.proto.
struct GrpcConfig {
  std::string listen = "127.0.0.1:7420";
  LinkSecurity security = LinkSecurity::unspecified;
  std::string keys{};
  std::string certificate{}, key{};
  std::string client_ca{};
  int paired_days = 365;

  /// Of what needs no file: invalid_argument names the field.
  [[nodiscard]] Status validate() const;
  [[nodiscard]] bool encrypted() const { return security == LinkSecurity::tls || security == LinkSecurity::mutual_tls; }
};

struct Config {
  std::string probe_name = "lightwell";
  CameraConfig camera;
  std::string calibration, mounting;  ///< Paths; empty: none.
  EstimatorConfig estimator;
  GrpcConfig grpc;
  std::string record_path;
  double budget_ms = 0;  ///< 0: none.
  std::optional<GreyPatch> grey_patch;
  std::optional<MarkerConfig> marker;  ///< None: light from a panorama.
  std::optional<UsbGadgetConfig> usb_gadget;
  std::optional<MqttConfig> mqtt;
  Mdns mdns = Mdns::off;
  std::vector<std::string> warnings;  ///< Of the file: deprecated fields, by name.

  [[nodiscard]] Status validate() const;
};

/// Reads a Config in protobuf text format. Errors name file, line and, for an unknown field, the nearest known one.
/// `camera_uri`, where not empty, stands in the place of the file's, which then needs none; `estimator` is the kind
/// that runs, where it is not the file that says so.
[[nodiscard]] Result<Config> load_config(const std::string& path, const std::string& camera_uri = {},
                                         std::optional<EstimatorKind> estimator = {});
/// The same from memory; `name` stands for the file in messages.
[[nodiscard]] Result<Config> parse_config(std::string_view text, const std::string& name,
                                          const std::string& camera_uri = {},
                                          std::optional<EstimatorKind> estimator = {});

}  // namespace lightwell
