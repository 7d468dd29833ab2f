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
  std::vector<double> exposure_s;  ///< Exposure times of the bracket, s. Empty: the camera's own exposure.
  double gain = 1;
};

/// How directions that no pixel sees are filled.
enum class UnseenFill : std::uint8_t {
  none = 1,     ///< Zero radiance.
  mirror = 2,   ///< The radiance of the direction mirrored at the plane that bounds the seen part.
  average = 3,  ///< The running mean of earlier frames that saw it; zero where none did.
};

enum class Smoothing : std::uint8_t { none = 1, one_euro = 2 };

/// What light is estimated from. The options of each kind are in the member of EstimatorConfig with the same name.
enum class EstimatorKind : std::uint8_t { panorama = 1, marker = 2 };
[[nodiscard]] std::string_view to_string(EstimatorKind kind);

/// Options of the panorama estimator. Meanings and defaults: config.proto.
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

/// Options of the marker estimator. Meanings and defaults: config.proto.
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

  /// Checks the values. invalid_argument names the field.
  [[nodiscard]] Status validate() const;
  /// Also checks that the estimator of this kind has every option that differs from its default. invalid_argument names
  /// the first option that it lacks and the estimator that has it.
  [[nodiscard]] Status validate(EstimatorKind kind) const;
  friend bool operator==(const EstimatorConfig&, const EstimatorConfig&) = default;
};

/// Names of the options of an estimator of this kind, in the order of config.proto: "band", "panorama.epsilon", ...
[[nodiscard]] std::vector<std::string> option_names(EstimatorKind kind);
/// The settings that make a difference for an estimator of this kind.
[[nodiscard]] std::span<const Setting> settings_of(EstimatorKind kind);

/// Partial update of an EstimatorConfig: the fields that have a value are changed.
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

/// `config` with the fields of `update` applied, without validation.
[[nodiscard]] EstimatorConfig updated(EstimatorConfig config, const EstimatorUpdate& update);
/// The update that sets every field as in `config`.
[[nodiscard]] EstimatorUpdate all_fields(const EstimatorConfig& config);

/// The active estimator and its options.
struct EstimatorState {
  EstimatorKind kind = EstimatorKind::panorama;
  EstimatorConfig config{};
};

/// An option as text, named as in option_names(): "panorama.epsilon" with value "0.01".
struct ConfigField {
  enum class Type : std::uint8_t { number, word };
  std::string name, value;
  Type type = Type::number;
};
/// All options of this estimator, in the order of option_names().
[[nodiscard]] std::vector<ConfigField> fields_of(const EstimatorState& estimator);
/// Sets one field of `update`; name and value as fields_of() writes them. invalid_argument names the nearest known
/// field, or the allowed values. Limits are not checked.
[[nodiscard]] Status set_field(EstimatorUpdate& update, std::string_view name, std::string_view value);

/// `config` with the error tolerances of the panorama estimator scaled by its setting: doubled for `fast`, zero for
/// `exact`, so that everything that was found is sent.
[[nodiscard]] EstimatorConfig config_for_setting(EstimatorConfig config);

/// A matte grey surface in the camera's view. It must receive the light that the probe measures.
struct GreyPatch {
  int lens = 0;
  int x = 0, y = 0, width = 0, height = 0;  ///< Rectangle in that lens's image, pixels; all of them on the patch.
  Vec3f normal{0, 1, 0};                    ///< Unit, probe frame.
  double albedo = 0.18;

  /// Checks the values, and that the rectangle lies inside the image. invalid_argument names the field.
  [[nodiscard]] Status validate(const RigParameters& rig) const;
};

/// Options for estimating light from a marker in view.
struct MarkerConfig {
  std::string body;  ///< Path of a MarkerBody.
};

struct UsbGadgetConfig {
  std::string ffs = "/dev/ffs-lightwell";  ///< Where FunctionFS is mounted.
};

enum class LinkSecurity : std::uint8_t { unspecified = 0, plain = 1, tls = 2, mutual_tls = 3 };

/// Meanings: config.proto. An empty path means none.
struct MqttConfig {
  std::string uri;
  std::string ca_file{}, certificate_file{}, key_file{}, login_file{};
  std::string client_id{};  ///< Empty: "lightwell-" and the probe's name.
  LinkSecurity security = LinkSecurity::unspecified;

  /// The address in `uri`, with the plain-text login that `security` allows. invalid_argument as validate().
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

  /// Checks all that needs no access to files. invalid_argument names the field.
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
  std::optional<MarkerConfig> marker;  ///< No value: light is estimated from a panorama.
  std::optional<UsbGadgetConfig> usb_gadget;
  std::optional<MqttConfig> mqtt;
  Mdns mdns = Mdns::off;
  std::vector<std::string> warnings;  ///< Warnings about the file: deprecated fields, by name.

  [[nodiscard]] Status validate() const;
};

/// Reads a Config in protobuf text format. Errors name file, line and, for an unknown field, the nearest known one.
/// A nonempty `camera_uri` replaces the file's, which then needs none. `estimator`, if it has a value, replaces the
/// kind that follows from the file.
[[nodiscard]] Result<Config> load_config(const std::string& path, const std::string& camera_uri = {},
                                         std::optional<EstimatorKind> estimator = {});
/// The same from memory; messages call it `name`.
[[nodiscard]] Result<Config> parse_config(std::string_view text, const std::string& name,
                                          const std::string& camera_uri = {},
                                          std::optional<EstimatorKind> estimator = {});

}  // namespace lightwell
