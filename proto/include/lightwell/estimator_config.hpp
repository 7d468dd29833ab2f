// The configuration of a probe's estimator, which a client reads and changes over a link. Meanings and defaults:
// proto/lightwell/v1/config.proto.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// How directions that no pixel sees are filled.
enum class UnseenFill : std::uint8_t {
  none = 1,     ///< Zero radiance.
  mirror = 2,   ///< The radiance of the direction mirrored at the plane that bounds the seen part.
  average = 3,  ///< The running mean of earlier frames that saw it; zero where none did.
};

enum class Smoothing : std::uint8_t { none = 1, one_euro = 2 };

/// What light is estimated from. The options of each kind are in the member of EstimatorConfig with the same name.
enum class EstimatorKind : std::uint8_t { panorama = 1, marker = 2, specular = 3 };
inline constexpr std::array kEstimatorKinds = {EstimatorKind::panorama, EstimatorKind::marker, EstimatorKind::specular};
[[nodiscard]] std::string_view to_string(EstimatorKind kind);

inline constexpr int kMaxInterleave = 16;
/// The least panorama.max_bytes. It holds band 0 and the total of the bound beside any header of a panorama.
inline constexpr int kMinMaxBytes = 96;

/// Options of the panorama estimator. Meanings and defaults: config.proto.
struct PanoramaEstimatorConfig {
  double light_threshold = 6;
  double epsilon = 0.01;
  double radiance_epsilon = 0;
  UnseenFill unseen = UnseenFill::none;
  Smoothing smoothing = Smoothing::one_euro;
  int environment_edge = 0;
  double environment_rate = 5;
  int interleave = 1;
  int max_bytes = 0;

  friend bool operator==(const PanoramaEstimatorConfig&, const PanoramaEstimatorConfig&) = default;
};

/// Options of the marker estimator. Meanings and defaults: config.proto.
struct MarkerEstimatorConfig {
  double decimation = 0;
  double search_decimation = 1;
  int max_faces = 0;

  friend bool operator==(const MarkerEstimatorConfig&, const MarkerEstimatorConfig&) = default;
};

/// Options of the specular estimator. Meanings and defaults: config.proto.
struct SpecularEstimatorConfig {
  int environment_edge = 0;

  friend bool operator==(const SpecularEstimatorConfig&, const SpecularEstimatorConfig&) = default;
};

/// Meanings and defaults: config.proto.
struct EstimatorConfig {
  int band = 6;
  int max_lights = 16;
  Setting setting = Setting::balanced;
  PanoramaEstimatorConfig panorama{};
  MarkerEstimatorConfig marker{};
  SpecularEstimatorConfig specular{};

  /// Checks the values. invalid_argument names the field.
  [[nodiscard]] Status validate() const;
  /// Also checks that the estimator of this kind has every option that differs from its default. invalid_argument names
  /// the first option that it lacks and the estimator that has it.
  [[nodiscard]] Status validate(EstimatorKind kind) const;
  friend bool operator==(const EstimatorConfig&, const EstimatorConfig&) = default;
};

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
    std::optional<int> interleave{};
    std::optional<int> max_bytes{};

    friend bool operator==(const Panorama&, const Panorama&) = default;
  };
  struct Marker {
    std::optional<double> decimation{};
    std::optional<double> search_decimation{};
    std::optional<int> max_faces{};

    friend bool operator==(const Marker&, const Marker&) = default;
  };

  struct Specular {
    std::optional<int> environment_edge{};

    friend bool operator==(const Specular&, const Specular&) = default;
  };

  std::optional<int> band{};
  std::optional<int> max_lights{};
  std::optional<Setting> setting{};
  Panorama panorama{};
  Marker marker{};
  Specular specular{};

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

/// An option as text, named as in config.proto: "panorama.epsilon" with value "0.01".
struct ConfigField {
  enum class Type : std::uint8_t { number, word };
  std::string name, value;
  Type type = Type::number;
};
/// All options of this estimator, in the order of config.proto.
[[nodiscard]] std::vector<ConfigField> fields_of(const EstimatorState& estimator);
/// The name of an option that is given by its former name; other names are unchanged.
[[nodiscard]] std::string current_option_name(std::string_view name);
/// Sets one field of `update`; name (also a former one) and value as fields_of() writes them. invalid_argument names
/// the nearest known field, or the allowed values. Limits are not checked.
[[nodiscard]] Status set_field(EstimatorUpdate& update, std::string_view name, std::string_view value);

}  // namespace lightwell
