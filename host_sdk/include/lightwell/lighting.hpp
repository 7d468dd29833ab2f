// The lighting at a probe at one moment: an immutable value returned by Probe.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <lightwell/color.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/time.hpp>
#include <lightwell/uncertain_pose.hpp>

namespace lightwell {

namespace core {
struct Sample;
}

/// Whether an answer can be used.
enum class Validity : std::uint8_t {
  valid,
  stale,           ///< The values were measured, but are or may be older than ProbeOptions::max_age.
  none,            ///< No descriptor has been received yet; the value is zero.
  before_history,  ///< The requested time is before the oldest stored descriptor; the value is zero.
  invalid_query,   ///< An argument is not a direction, roughness or rotation; the value is zero.
};

[[nodiscard]] constexpr std::string_view to_string(Validity validity) {
  constexpr std::string_view kNames[] = {"valid", "stale", "none", "before_history", "invalid_query"};
  return validity <= Validity::invalid_query ? kNames[static_cast<std::size_t>(validity)] : "unknown";
}

/// How an answer was derived from descriptors.
enum class Derivation : std::uint8_t {
  measured,      ///< From one descriptor: the newest, or that of exactly the requested time.
  interpolated,  ///< Interpolated between two descriptors.
  extrapolated,  ///< After the newest: its lights moved on with constant velocity, within ProbeOptions::extrapolation.
  held,          ///< Later than that: the newest descriptor unchanged.
};

[[nodiscard]] constexpr std::string_view to_string(Derivation derivation) {
  constexpr std::string_view kNames[] = {"measured", "interpolated", "extrapolated", "held"};
  return derivation <= Derivation::held ? kNames[static_cast<std::size_t>(derivation)] : "unknown";
}

/// Whether a value includes the discrete lights.
enum class LightsIncluded : std::uint8_t { yes, no };

/// A value with its validity, age and error bound.
template <class T>
struct Answer {
  T value{};
  Validity validity = Validity::none;
  Duration age;           ///< As Lighting::age().
  float error_bound = 0;  ///< Descriptor::bound.total; infinite where no bound exists; the flags give the reason.
  Flags flags;            ///< Conditions under which the value may be wrong.
  LightsIncluded lights = LightsIncluded::yes;
};

/// A prefiltered environment map for reflections, without the lights. For texels, levels and exponent see
/// EnvironmentMap; here the map is always whole, with changes applied. A renderer that samples the map must add the
/// highlights of the lights itself. One that draws a mirror samples `mirror`, and draws as caps the lights that are not
/// shown_in_mirror().
struct EnvironmentView {
  const EnvironmentMap& map;  ///< Valid as long as the Lighting that returned it, or a copy of that.
  /// p_lighting = rotation p_map. The identity unless rotated(), or the probe has turned since the map against a plane
  /// that it moves around (origin()).
  Quat rotation;
  std::uint64_t sequence;  ///< Sequence number of the descriptor with the map: upload the map when this changes.
  Duration older_by;       ///< Mid-exposure of this lighting's descriptor minus that of the map's descriptor.
  /// A map of one level, the first one of `map` with the lights that texels show better than caps do, a window for
  /// example. `map` itself where there are none, or where one of them is no longer in lights().
  const EnvironmentMap& mirror;

  [[nodiscard]] bool shown_in_mirror(const Light& light) const {
    return &mirror != &map && std::ranges::binary_search(map.light_tracks, light.track);
  }
};

/// The lighting of one moment, immutable. Cheap to copy: copies share their state. Any number of threads may query it
/// concurrently. It is not updated: get the next one from the Probe. Directions and normals are in the probe's axes
/// (right-handed, +Y up, -Z forward) unless rotated(); they need not be normalised. No method throws or blocks, no
/// value is NaN.
class Lighting {
 public:
  /// Default age above which answers are stale.
  static constexpr Duration kDefaultMaxAge{250'000'000};

  /// Validity::none.
  Lighting() = default;

  /// Lighting of a descriptor that was not received by a Probe: from a file, in a test.
  [[nodiscard]] static Lighting of(Descriptor descriptor, Duration age = {}, Duration max_age = kDefaultMaxAge);

  /// Used by the SDK. `sample` may be null if `validity` is neither valid nor stale.
  Lighting(std::shared_ptr<const core::Sample> sample, Validity validity, Duration age, Duration max_age,
           Derivation derivation = Derivation::measured);

  [[nodiscard]] Validity validity() const { return validity_; }

  [[nodiscard]] Derivation derivation() const { return derivation_; }

  /// Time since mid-exposure when this was obtained. For Probe::at(t): between t and the nearest mid-exposure. Never
  /// negative: a time that the clock error puts into the future counts as now.
  [[nodiscard]] Duration age() const { return age_; }

  /// Maximum error of age() (ProbeInfo::clock_uncertainty when the descriptor was received). An answer is stale if it
  /// can be older than max_age within this uncertainty.
  [[nodiscard]] Duration age_uncertainty() const;

  /// Human-readable reason if validity() is not valid; empty otherwise.
  [[nodiscard]] std::string reason() const;

  /// The descriptor (rotated, after rotated()); one without light if validity() is neither valid nor stale.
  [[nodiscard]] const Descriptor& descriptor() const;

  /// Size of the received message; 0 if there is none.
  [[nodiscard]] std::size_t encoded_bytes() const;

  /// Mid-exposure in the host's clock; 0 if there is no descriptor.
  [[nodiscard]] HostTime mid_exposure() const;

  /// When the message was received; 0 if there is none.
  [[nodiscard]] HostTime received() const;

  /// Irradiance of a flat receiver that faces `normal`; its luminance is in lux if units() are absolute. Not divided by
  /// pi (reflected_radiance does that). The sum of A_l c_lm Y_lm (Ramamoorthi & Hanrahan 2001, eq. 7) and of each
  /// light's cap, clipped at the receiver's horizon. NOT clamped: a nearly dark side can be slightly negative where
  /// the truncated series rings. error_bound includes this error; clamp at zero for shading. invalid_query for a normal
  /// that is zero, NaN or infinite.
  [[nodiscard]] Answer<Irradiance> irradiance(Vec3f normal) const;

  /// Batch version, for light maps and an engine's probes: out[i] for normals[i]. The answer's value is the number of
  /// normals that are zero, NaN or infinite. If there is one, the answer is an invalid_query, the irradiance of these
  /// normals is zero, and the others are valid. Spans of different lengths are an invalid_query too; then nothing is
  /// written. Differs from irradiance(normal) by less than 1e-5 of the largest irradiance, because the harmonics are
  /// summed in another order.
  Answer<std::size_t> irradiance(std::span<const Vec3f> normals, std::span<Irradiance> out) const;

  /// Radiance from `direction` as reflected by a surface of that perceptual roughness (alpha = r², as in glTF): the
  /// GGX-weighted mean with N = V = R = direction. Luminance in cd/m² if units() are absolute. Roughness above 1 is
  /// clamped to 1, between 0 and GgxLobe::kMinRoughness to the latter, below 0 to 0. At 0 (a mirror) the discrete
  /// lights are excluded, because a point light has no radiance, and `lights` is no. With an environment() this is
  /// environment_radiance() plus the lights as caps under the GGX lobe; as far as the first level has a share in it,
  /// lights that its texels show better than caps do (EnvironmentView::mirror) are these texels. Without one the
  /// harmonics replace the map: blurred at low roughness, non-negative, with the weakest window that prevents ringing
  /// and with an estimate of the bands that were not sent (reconstruction.hpp). invalid_query for a direction that is
  /// zero, NaN or infinite and for a roughness that is not finite. Each thread caches the lobe of its last roughness:
  /// many directions at one roughness are cheaper than many roughnesses.
  [[nodiscard]] Answer<Radiance> radiance(Vec3f direction, float perceptual_roughness) const;

  /// Strongest first. Valid as long as this object or a copy of it.
  [[nodiscard]] std::span<const Light> lights() const;

  /// Pose of the point at which the light holds, in the frame of this lighting: T_probe_origin, after in_world()
  /// T_world_origin. A panoramic probe's origin is the probe; that of a marker is the marker's centre, with the axes of
  /// its body. Directions are from the origin, irradiances those at it. Its rotation turns no direction.
  [[nodiscard]] Pose origin() const { return descriptor().T_probe_origin; }

  /// Position of one of lights(), m, in the frame of this lighting; nullopt for a light whose distance is not known: it
  /// is distant, or was not observed. The standard deviation along the direction is Light::distance_sigma_m, across it
  /// that of the direction times the distance; the error of the origin is not included.
  [[nodiscard]] std::optional<Vec3d> position(const Light& light) const;

  /// The environment map at this moment: that of this descriptor, or the newest before it (a probe sends maps more
  /// rarely than descriptors). None if the probe sends none, if none was received yet, if the last one is older than
  /// three intervals between whole maps, or if it has other units.
  [[nodiscard]] std::optional<EnvironmentView> environment() const;

  /// The strongest light.
  [[nodiscard]] std::optional<Light> primary_light() const;

  /// The same lighting in a frame rotated by q about the probe: p_new = q p_old. To light a world of known pose, q is
  /// the rotation of T_world_probe; in_world() also moves the origin. The environment map is not resampled:
  /// EnvironmentView::rotation is its rotation, and descriptor() does not contain it. About 20 µs. invalid_query if q
  /// is zero or not finite.
  [[nodiscard]] Lighting rotated(Quat q) const;

  /// The same lighting in the application's world frame: origin() and position() are in the world, directions in its
  /// axes. Irradiance and radiance remain those at the origin; they do not depend on the translation. At a distance d
  /// from the origin and D from a lamp the relative error of its irradiance is up to about 2 d / D. A caller who knows
  /// position() can move a near lamp: its irradiance at a point falls with the squared distance. invalid_query as
  /// rotated(), and for a translation that is not finite.
  [[nodiscard]] Lighting in_world(const Pose& T_world_probe) const;

  /// The same for an uncertain pose: its rotation covariance is added to each light's direction_covariance (infinite
  /// where the rotation is unknown). The error bound does not include it. If a component of the translation is unknown
  /// (infinite variance), no light has a distance or a position.
  [[nodiscard]] Lighting in_world(const UncertainPose& T_world_probe) const;

  /// T_world_probe in the frame of the room, as the probe reported it when this descriptor was received, for
  /// in_world(*mounting()). Null if the probe has no mounting, and after a rotation. Valid as long as this object.
  [[nodiscard]] const UncertainPose* mounting() const;

  [[nodiscard]] Units units() const { return descriptor().units; }

 private:
  template <class T>
  [[nodiscard]] Answer<T> answer() const;
  /// In the frame b of T_b_a, whose rotation need not be normalised; this is in frame a.
  [[nodiscard]] Lighting in_frame(const Pose& T_b_a) const;

  std::shared_ptr<const core::Sample> sample_;
  Validity validity_ = Validity::none;
  Duration age_;
  Duration max_age_ = kDefaultMaxAge;
  Derivation derivation_ = Derivation::measured;
};

}  // namespace lightwell
