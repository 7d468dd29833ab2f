// lightwelld's configuration as a value. Meanings and defaults: proto/lightwell/v1/config.proto.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/captured_plane.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/mqtt.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// Exposure, gain and white balance of a camera. They are constant while it streams: automatic controls are off.
struct CaptureSettings {
  static constexpr int kMaxExposures = 8;
  static constexpr double kDefaultWhiteBalance_k = 5000;

  std::vector<double> exposure_s{};         ///< Exposure times of the bracket, s. Empty: the camera's own exposure.
  std::optional<double> gain{};             ///< Linear gain of the sensor. No value: 1.
  std::optional<double> white_balance_k{};  ///< Colour temperature of the light that becomes white, K.
  std::optional<std::array<double, 2>> colour_gains{};  ///< Gains of red and blue relative to green.

  /// invalid_argument names the parameter of a camera URI and the field of the configuration.
  [[nodiscard]] Status validate() const;
};

struct CameraConfig {
  std::string uri;
  int width = 640;
  int height = 480;
  double frame_rate = 30;
  CaptureSettings capture{};
};

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
  std::string body_file;  ///< Path of a MarkerBody.
};

/// Options for estimating light from a glossy plane in view.
struct PlaneConfig {
  std::string plane_file;                            ///< Path of a GlossyPlane.
  ImageRecipients images = ImageRecipients::nobody;  ///< The deprecated field; Config::texture_recipients().
};

struct UsbGadgetConfig {
  std::string functionfs_mount = "/dev/ffs-lightwell";  ///< Where FunctionFS is mounted.
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
  std::string listen_address = "127.0.0.1:7420";
  LinkSecurity security = LinkSecurity::unspecified;
  std::string key_folder{};
  std::string certificate{}, key{};
  std::string client_ca{};
  int client_certificate_days = 365;

  /// Checks all that needs no access to files. invalid_argument names the field.
  [[nodiscard]] Status validate() const;
  /// failed_precondition, with the remedies: it would listen in plain text on an address that other machines reach,
  /// without an explicit choice of plain text.
  [[nodiscard]] Status check_bind_policy() const;
  [[nodiscard]] bool encrypted() const { return security == LinkSecurity::tls || security == LinkSecurity::mutual_tls; }
};

/// Whether the web link serves the dashboard's page.
enum class Dashboard : std::uint8_t { off = 1, on = 2 };

/// The link by WebSocket and HTTP. Meanings and defaults: config.proto.
struct WebConfig {
  static constexpr std::size_t kMaxAllowedOrigins = 16;

  std::string listen_address = "127.0.0.1:7443";
  LinkSecurity security = LinkSecurity::unspecified;
  std::string certificate{}, key{};
  std::string client_ca{};
  Dashboard dashboard = Dashboard::on;
  std::vector<std::string> allowed_origins{};

  /// As those of GrpcConfig.
  [[nodiscard]] Status validate() const;
  [[nodiscard]] Status check_bind_policy() const;
  [[nodiscard]] bool encrypted() const { return security == LinkSecurity::tls || security == LinkSecurity::mutual_tls; }
};

/// The folder of recordings that clients start. Meanings: config.proto.
struct RecordingsConfig {
  static constexpr std::uint32_t kMaxFiles = 10'000;

  std::string folder;
  std::uint64_t max_bytes = 1'000'000'000;
  std::uint32_t max_files = 100;
  std::uint64_t min_free_bytes = 200'000'000;

  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

struct Config {
  std::string probe_name = "lightwell";
  CameraConfig camera;
  std::string calibration, mounting;  ///< Paths; empty: none.
  EstimatorKind estimator_kind = EstimatorKind::panorama;
  EstimatorConfig estimator;
  GrpcConfig grpc;
  std::string record_path;
  double budget_ms = 0;  ///< 0: none.
  double max_bound = 0;  ///< 0: none.
  std::optional<GreyPatch> grey_patch;
  std::optional<MarkerConfig> marker;  ///< The marker estimator needs it.
  std::optional<PlaneConfig> plane;    ///< The specular estimator needs it.
  std::optional<UsbGadgetConfig> usb_gadget;
  std::optional<MqttConfig> mqtt;
  std::optional<WebConfig> web;
  std::optional<RecordingsConfig> recordings;
  Mdns mdns = Mdns::off;
  ImageRecipients images = ImageRecipients::nobody;  ///< Of pictures of what the camera sees.
  std::vector<std::string> warnings;                 ///< Warnings about the file: deprecated and renamed fields.

  [[nodiscard]] Status validate() const;
  /// Of the captured plane's texture: `images`, or the deprecated consent of `plane` to the texture alone.
  [[nodiscard]] ImageRecipients texture_recipients() const;
  /// The keys and authorities of the web link: those of `grpc`, but for what `web` names itself.
  [[nodiscard]] GrpcConfig web_keys() const;
};

/// Reads a Config in protobuf text format. Errors name file, line and, for an unknown field, the nearest known one.
/// A nonempty `camera_uri` replaces the file's, which then needs none. `estimator`, if it has a value, replaces the
/// kind that follows from the file. Paths that are relative to the file's folder are made relative to the working
/// folder.
[[nodiscard]] Result<Config> load_config(const std::string& path, const std::string& camera_uri = {},
                                         std::optional<EstimatorKind> estimator = {});
/// The same from memory; messages call it `name`. Paths stay as they are.
[[nodiscard]] Result<Config> parse_config(std::string_view text, const std::string& name,
                                          const std::string& camera_uri = {},
                                          std::optional<EstimatorKind> estimator = {});

}  // namespace lightwell
