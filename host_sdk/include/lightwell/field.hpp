// Light that varies in space: several probes, or one that is moved, feed one field, which answers for points where no
// probe is. Optional library lightwell_field; method and limits: host_sdk/src/field/README.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>
#include <lightwell/uncertain_pose.hpp>

namespace lightwell {

/// What a probe measured at one place and time.
struct FieldSample {
  Descriptor light;             ///< In the probe's axes.
  UncertainPose T_world_probe;  ///< World: the frame of the field, +Y up, m. Every variance must be finite.
  HostTime mid_exposure;
  Duration time_uncertainty;  ///< Maximum error of mid_exposure.
};

/// The sample of a Lighting that a Probe returned, with the times of the SDK's clock. `light` is in the probe's frame:
/// neither rotated() nor in_world().
[[nodiscard]] FieldSample field_sample(const Lighting& light, const UncertainPose& T_world_probe);

/// The newest time at which all of these probes have measured: the oldest mid-exposure of their newest lightings
/// (Probe::latest()). Probes that measure at different times give samples of one time by Probe::at() of it; lights that
/// move are then where they were at that time. A probe without an estimate, and one that lags more than `max_lag`
/// behind the newest, does not count. nullopt where none counts.
[[nodiscard]] std::optional<HostTime> common_time(std::span<const Lighting> newest,
                                                  Duration max_lag = Duration{500'000'000});

struct FieldOptions {
  /// Answers that rest on samples older than this are stale.
  Duration max_age{1'000'000'000};
  /// Samples older than this take no part.
  Duration drop_age{60'000'000'000};
  /// Distance from a probe, m, over which light of unknown place is taken to change by its own size. Sets how fast the
  /// bound grows where the probes themselves do not show how fast the light changes.
  double typical_distance_m = 3;

  /// invalid_argument names the option.
  [[nodiscard]] Status validate() const;
};

/// Largest number of samples (places) in a field, and of triangles of its proxy geometry.
inline constexpr std::size_t kMaxFieldProbes = 256;
inline constexpr std::size_t kMaxFieldTriangles = 200'000;

/// A light that two or more probes saw, or one whose distance a probe measured.
struct FieldLight {
  std::uint32_t id = 0;  ///< Stays with the same light from one update to the next. Not 0.
  /// False: distant. Its inverse distance is less than two standard deviations from zero.
  bool placed = false;
  Vec3d position;                               ///< m, world; of a placed light.
  std::array<double, 6> position_covariance{};  ///< xx, xy, xz, yy, yz, zz, m²; of a placed light.
  Vec3f direction;                              ///< Unit, TOWARDS the light, world; of a distant light.
  float direction_sigma_rad = 0;  ///< Standard deviation of `direction` in each tangent; of a distant light.
  /// Placed: radiant intensity, irradiance times m², the mean over directions. Distant: irradiance at normal incidence.
  Irradiance intensity;
  /// Placed: radiant intensity towards the unit vector w is max(0, intensity + sum of gradient[i] w[i]).
  std::array<Irradiance, 3> intensity_gradient{};
  float radius = 0;          ///< Placed: radius of the ball with the same angular radius, m. Distant: rad.
  std::uint32_t probes = 0;  ///< That saw it.
};

/// What the field makes of a probe's sample.
enum class FieldProbeState : std::uint8_t {
  used,
  stale,         ///< Used, but older than max_age at the last update.
  expired,       ///< Older than drop_age: takes no part.
  wrong_clock,   ///< Mid-exposure is in the future: takes no part.
  wrong_pose,    ///< Its lights are not where those of the other probes are: takes no part.
  wrong_scale,   ///< No common factor brings its light and that of the others together: takes no part.
  contradicted,  ///< Used, but a probe close by measured another light.
};

[[nodiscard]] constexpr std::string_view to_string(FieldProbeState state) {
  constexpr std::string_view kNames[] = {"used",       "stale",       "expired",     "wrong_clock",
                                         "wrong_pose", "wrong_scale", "contradicted"};
  return state <= FieldProbeState::contradicted ? kNames[static_cast<std::size_t>(state)] : "unknown";
}

struct FieldProbe {
  std::string name;
  Vec3d position;  ///< Of the descriptor's origin, world, m.
  FieldProbeState state = FieldProbeState::used;
  std::string reason;           ///< Empty if `state` is used.
  double scale = 1;             ///< Factor on its light that brings it to the common scale.
  std::uint32_t lights = 0;     ///< Of its lights, how many it reported,
  std::uint32_t matched = 0;    ///< how many were matched with those of other probes,
  std::uint32_t ambiguous = 0;  ///< and how many fit several lights equally well, so that they were not matched.
};

/// The result of an update. Immutable.
struct FieldState {
  std::vector<FieldLight> lights;  ///< By falling luminance of their irradiance at the probe that sees them best.
  std::vector<FieldProbe> probes;  ///< By name.
  Units units = Units::relative;   ///< Of the common scale: absolute if a probe that is used is.
  std::uint64_t updates = 0;       ///< Number of the update.
};

/// Why an answer of the field may be wrong, or how it was derived.
enum class FieldFlag : std::uint8_t {
  one_probe = 0,          ///< The light is that of one probe; nothing shows how it changes.
  far_from_probes = 1,    ///< Farther from every probe than typical_distance_m.
  contradiction = 2,      ///< Probes that contribute measured different light close together.
  at_light = 3,           ///< The point is at a placed light, within its radius or the uncertainty of its place.
  occlusion_unknown = 4,  ///< A strong light is hidden from some of the probes that contribute, and no geometry tells.
};
inline constexpr std::array kFieldFlags = {FieldFlag::one_probe, FieldFlag::far_from_probes, FieldFlag::contradiction,
                                           FieldFlag::at_light, FieldFlag::occlusion_unknown};

[[nodiscard]] constexpr std::string_view to_string(FieldFlag flag) {
  constexpr std::string_view kNames[] = {"one_probe", "far_from_probes", "contradiction", "at_light",
                                         "occlusion_unknown"};
  return flag <= FieldFlag::occlusion_unknown ? kNames[static_cast<std::size_t>(flag)] : "unknown";
}

class FieldFlags {
 public:
  constexpr void set(FieldFlag f) { bits_ |= 1U << static_cast<unsigned>(f); }
  [[nodiscard]] constexpr bool has(FieldFlag f) const { return (bits_ >> static_cast<unsigned>(f) & 1U) != 0; }
  friend constexpr bool operator==(FieldFlags, FieldFlags) = default;

 private:
  std::uint32_t bits_ = 0;
};

/// The light at a point.
struct FieldAnswer {
  /// In the world's axes; origin() is the point. Its descriptor has the lights at the point, with distances where they
  /// are known, and `bound.total` is the bound: on the RMS error of the irradiance over all normals relative to the RMS
  /// irradiance, at 95 % confidence; infinite where it would exceed 1. Validity::none without probes, invalid_query for
  /// a position that is not finite.
  Lighting light;
  FieldFlags flags;
  double nearest_probe_m = 0;  ///< Infinite without probes.
};

/// Triangles around the probes: walls, a scan. One-sided or not does not matter.
struct FieldGeometry {
  std::span<const Vec3f> vertices;         ///< World, m.
  std::span<const std::uint32_t> indices;  ///< Three a triangle.
};

/// A light field. One thread at a time changes it (set, remove, set_geometry, update); any number of threads query it
/// meanwhile, without locks.
class LightField {
 public:
  /// invalid_argument for options that do not validate.
  [[nodiscard]] static Result<LightField> make(const FieldOptions& options = {});
  LightField(LightField&&) noexcept;
  LightField& operator=(LightField&&) noexcept;
  ~LightField();

  /// Adds or replaces the sample of a probe. For one that is moved, each place has a name of its own. Takes effect at
  /// the next update(). invalid_argument for a pose or a descriptor with values that are not finite, an unknown
  /// variance of the pose or an empty name; resource_exhausted beyond kMaxFieldProbes.
  [[nodiscard]] Status set(std::string_view name, FieldSample sample);
  /// False if there is none of that name. Takes effect at the next update().
  bool remove(std::string_view name);

  /// Replaces the proxy geometry; empty removes it. Takes effect at the next update(). failed_precondition in a build
  /// without Embree; invalid_argument for an index out of range or a vertex that is not finite; resource_exhausted
  /// beyond kMaxFieldTriangles.
  [[nodiscard]] Status set_geometry(const FieldGeometry& geometry);

  /// Matches and places the lights of all samples anew and publishes the result for queries. Milliseconds to a tenth of
  /// a second. Returns what it made of lights and probes.
  std::shared_ptr<const FieldState> update(HostTime now);

  /// Of the last update; never null. Any thread.
  [[nodiscard]] std::shared_ptr<const FieldState> state() const;

  /// The light at `position` (m, world). Any thread.
  [[nodiscard]] FieldAnswer at(Vec3d position, HostTime now) const;
  /// Batch version, for a grid of points: out[i] for positions[i], all of one update. False, and nothing is written, if
  /// the lengths differ.
  bool at(std::span<const Vec3d> positions, HostTime now, std::span<FieldAnswer> out) const;
  /// Irradiance of a flat receiver that faces `normal` at `position`: at(position).light.irradiance(normal), without
  /// the parts of a Lighting that this does not need.
  [[nodiscard]] Answer<Irradiance> irradiance(Vec3d position, Vec3f normal, HostTime now) const;

 private:
  class Impl;
  explicit LightField(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Whether this build has Embree, for set_geometry().
[[nodiscard]] bool field_has_geometry();

}  // namespace lightwell
