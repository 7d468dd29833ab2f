// How a place is lit, at one moment: the immutable answer that a Probe hands out.
//   Validity, Derivation, LightsIncluded, Answer<T>   an answer, what it is made of, and what it is worth
//   EnvironmentView                       the map for reflections, for engines that upload it
//   Lighting                              irradiance, radiance and lights of one moment
#pragma once

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

/// May an answer be used?
enum class Validity : std::uint8_t {
  valid,
  stale,           ///< The numbers are real but older than ProbeOptions::max_age, or may be.
  none,            ///< No descriptor has come yet; the value is zero.
  before_history,  ///< The moment asked for lies before the oldest kept; the value is zero.
  invalid_query,   ///< The question was no direction, roughness or rotation; the value is zero.
};

[[nodiscard]] constexpr std::string_view to_string(Validity validity) {
  switch (validity) {
    case Validity::valid:
      return "valid";
    case Validity::stale:
      return "stale";
    case Validity::none:
      return "none";
    case Validity::before_history:
      return "before_history";
    case Validity::invalid_query:
      return "invalid_query";
  }
  return "unknown";
}

/// How an answer came about.
enum class Derivation : std::uint8_t {
  measured,      ///< One descriptor, and the moment asked for is its own, or it is the newest.
  interpolated,  ///< Between two.
  extrapolated,  ///< Beyond the newest: its lights moved on as they moved before, within ProbeOptions::extrapolation.
  held,          ///< Beyond that: the newest as it was. What happened since is not known.
};

[[nodiscard]] constexpr std::string_view to_string(Derivation derivation) {
  switch (derivation) {
    case Derivation::measured:
      return "measured";
    case Derivation::interpolated:
      return "interpolated";
    case Derivation::extrapolated:
      return "extrapolated";
    case Derivation::held:
      return "held";
  }
  return "unknown";
}

/// Does a value hold the discrete lights, or only what is left without them?
enum class LightsIncluded : std::uint8_t { yes, no };

/// A value with all that is needed to decide whether to believe it.
template <class T>
struct Answer {
  T value{};
  Validity validity = Validity::none;
  Duration age;           ///< As Lighting::age().
  float error_bound = 0;  ///< Descriptor::bound.total; infinite where the flags say why.
  Flags flags;            ///< Why the value may be wrong all the same.
  LightsIncluded lights = LightsIncluded::yes;
};

/// A prefiltered map for reflections, lights left out. What its texels, levels and exponent mean
/// stands at EnvironmentMap; always whole here, changes are applied. An engine that looks it up
/// adds the lights itself: a discrete light has no radiance, but a highlight.
struct EnvironmentView {
  const EnvironmentMap& map;  ///< Lives as long as the Lighting that gave it, or a copy of that.
  Quat rotation;              ///< p_lighting = rotation p_map. The identity unless rotated().
  std::uint64_t sequence;     ///< Of the descriptor that brought it: upload when this changes.
  Duration older_by;          ///< Mid-exposure of this lighting's descriptor less that of the map's.
};

/// An immutable answer to "how is this place lit". Cheap to copy: copies share one state, and any
/// number of threads may ask at once. It does not follow the probe: ask the Probe again for the
/// next. Directions and normals are in the probe's frame (right-handed, +Y up, -Z forward) unless
/// rotated(); they need not be normalised. No method throws or blocks, no answer is NaN.
class Lighting {
 public:
  /// Older answers are stale, where nobody says otherwise.
  static constexpr Duration kDefaultMaxAge{250'000'000};

  /// Validity::none.
  Lighting() = default;

  /// The light of a descriptor that came by other ways than a Probe: from a file, from a test.
  [[nodiscard]] static Lighting of(Descriptor descriptor, Duration age = {}, Duration max_age = kDefaultMaxAge);

  /// Of the SDK; `sample` may be null where `validity` says that there is none.
  Lighting(std::shared_ptr<const core::Sample> sample, Validity validity, Duration age, Duration max_age,
           Derivation derivation = Derivation::measured);

  [[nodiscard]] Validity validity() const { return validity_; }

  [[nodiscard]] Derivation derivation() const { return derivation_; }

  /// Since mid-exposure, at the moment it was asked. Of Probe::at(t): from the nearest mid-exposure
  /// to t. Never negative: what the clocks' uncertainty puts into the future counts as now.
  [[nodiscard]] Duration age() const { return age_; }

  /// What age() may be off by, as far as the clocks are known (ProbeInfo::clock_uncertainty when it came). It counts
  /// against an answer: one that may be older than max_age is stale.
  [[nodiscard]] Duration age_uncertainty() const;

  /// Why this is not valid, for a person; empty where it is.
  [[nodiscard]] std::string reason() const;

  /// What came from the probe; of rotated(), turned; a descriptor without light where validity() is
  /// neither valid nor stale.
  [[nodiscard]] const Descriptor& descriptor() const;

  /// Of the message as received; 0 where there was none.
  [[nodiscard]] std::size_t encoded_bytes() const;

  /// Mid-exposure in the host's clock; 0 where there was none.
  [[nodiscard]] HostTime mid_exposure() const;

  /// When the message was here; 0 where there was none.
  [[nodiscard]] HostTime received() const;

  /// Irradiance of a flat receiver that faces `normal`; its luminance is in lux where units() are
  /// absolute. Not divided by pi (reflected_radiance does that). The sum of A_l c_lm Y_lm
  /// (Ramamoorthi & Hanrahan 2001, eq. 7) and of each light's cap, clipped at the receiver's
  /// horizon. NOT clamped: where the harmonics ring, a side that is nearly dark can come out
  /// slightly negative. That is the error which error_bound speaks of; whoever shades clamps at
  /// zero. invalid_query for a normal that is zero, NaN or infinite.
  [[nodiscard]] Answer<Irradiance> irradiance(Vec3f normal) const;

  /// The same at many normals, for light maps and probes of an engine: out[i] for normals[i]. The answer's value is how
  /// many normals were zero, NaN or infinite: their irradiance is zero, and where there is one the answer is an
  /// invalid_query, the others as good as otherwise; so are spans of different lengths, of which nothing is written.
  /// Within 1e-5 of the largest irradiance of irradiance(normal), as the harmonics are summed in another order.
  Answer<std::size_t> irradiance(std::span<const Vec3f> normals, std::span<Irradiance> out) const;

  /// Radiance from `direction` as a surface of that perceptual roughness (alpha = r², as in glTF)
  /// sees it: the GGX-weighted mean with N = V = R = direction. Luminance in cd/m² where absolute.
  /// Roughness is clamped: above 1 to 1, from 0 to GgxLobe::kMinRoughness to that, below 0 to 0.
  /// At 0, a mirror, the discrete lights are left out (a point has no radiance) and `lights` says
  /// so. Where there is an environment() it comes from that (environment_radiance(), between two
  /// levels by roughness) and from the lights as caps under the GGX lobe; without one the harmonics
  /// stand for the map: soft at low roughness, never negative, windowed as little as keeps them from ringing, and with
  /// an estimate of the bands that were not sent (reconstruction.hpp). invalid_query for a direction that is
  /// zero, NaN or infinite and a roughness that is not finite. Each thread keeps the lobe of the roughness it asked
  /// last: many directions at one roughness are cheaper than many roughnesses.
  [[nodiscard]] Answer<Radiance> radiance(Vec3f direction, float perceptual_roughness) const;

  /// Strongest first. Lives as long as this object or a copy of it.
  [[nodiscard]] std::span<const Light> lights() const;

  /// The map for reflections that held at this moment: of this descriptor, or the newest before it
  /// (a probe sends maps more rarely than descriptors). None where the probe sends none, where none
  /// came yet, and where the last is older than three of the intervals at which whole ones come, or
  /// has other units.
  [[nodiscard]] std::optional<EnvironmentView> environment() const;

  /// The strongest light.
  [[nodiscard]] std::optional<Light> primary_light() const;

  /// The same light in a frame turned by q, p_new = q p_old: to light a world whose pose against
  /// the probe is known, take q = rotation of T_world_probe. The environment map is not
  /// resampled: EnvironmentView::rotation says how it is turned, and descriptor() leaves it out.
  /// About 20 µs. invalid_query where q is zero or not finite.
  [[nodiscard]] Lighting rotated(Quat q) const;

  /// The same light in the application's own world: T_world_probe maps points of the probe into it.
  /// Only its rotation counts: a descriptor says from which direction light comes, not from how far
  /// away, so at the probe and beside it the light is the same. Near a lamp that is wrong by about
  /// the distance to the probe over that to the lamp; to know better takes the lamp's place, which
  /// two probes, or one that moved, would tell. As rotated().
  [[nodiscard]] Lighting in_world(const Pose& T_world_probe) const;

  /// The same of a pose that says how sure it is: the doubt of its rotation is added to each
  /// light's direction_covariance (infinite where nothing is known of the rotation). The bound does
  /// not speak of it.
  [[nodiscard]] Lighting in_world(const UncertainPose& T_world_probe) const;

  /// T_world_probe of the room, as the probe told it when this came: in_world(*mounting()). Null where the probe does
  /// not know where it hangs, and once turned. Lives as long as this.
  [[nodiscard]] const UncertainPose* mounting() const;

  [[nodiscard]] Units units() const { return descriptor().units; }

 private:
  template <class T>
  [[nodiscard]] Answer<T> answer() const;

  std::shared_ptr<const core::Sample> sample_;
  Validity validity_ = Validity::none;
  Duration age_;
  Duration max_age_ = kDefaultMaxAge;
  Derivation derivation_ = Derivation::measured;
};

}  // namespace lightwell
