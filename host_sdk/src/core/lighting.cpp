#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <lightwell/harmonics.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/lobes.hpp>
#include <lightwell/query.hpp>
#include <lightwell/text.hpp>

#include "core/irradiance_rows.hpp"
#include "core/sample.hpp"

namespace lightwell {
namespace {

constexpr Vec3f kZero{};
constexpr std::array<double, kMaxBand + 1> kMirror{1, 1, 1, 1, 1, 1, 1};

const core::Sample& no_sample() {
  static const core::Sample none{};
  return none;
}

struct RoughnessLobe {
  explicit RoughnessLobe(float r) : roughness(r), lobe(static_cast<double>(r)), band_factor(lobe.coefficients()) {}
  float roughness;
  GgxLobe lobe;
  std::array<double, kMaxBand + 1> band_factor;
};

/// The last lobe of each thread is cached: its coefficients take microseconds of quadrature, and shading usually
/// evaluates many directions at one roughness.
const RoughnessLobe& lobe_of(float roughness) {
  thread_local RoughnessLobe last(roughness);
  if (last.roughness != roughness) last = RoughnessLobe(roughness);
  return last;
}

/// What changes where the first level of a map shows some lights as texels instead of caps, as far as it has a share.
Radiance shown_lights(const EnvironmentView& view, std::span<const Light> lights, Vec3f d, const RoughnessLobe& rough,
                      float share) {
  const Vec3f in_map = rotate(view.rotation.inverse(), d);
  Radiance sum = environment_radiance(view.mirror, in_map, 0) - environment_radiance(view.map, in_map, 0);
  for (const Light& light : lights)
    if (view.shown_in_mirror(light)) sum = sum - lights_radiance(std::span(&light, 1), d, rough.lobe);
  return sum * share;
}

}  // namespace

Lighting::Lighting(std::shared_ptr<const core::Sample> sample, Validity validity, Duration age, Duration max_age,
                   Derivation derivation)
    : sample_(std::move(sample)), validity_(validity), age_(age), max_age_(max_age), derivation_(derivation) {}

Lighting Lighting::of(Descriptor descriptor, Duration age, Duration max_age) {
  core::Sample made = core::sample_of(std::move(descriptor));
  core::EnvironmentAssembler assembler;
  (void)assembler.take(made.descriptor);
  made.environment = assembler.map_for(made.descriptor);
  core::add_reconstruction(made);
  auto sample = std::make_shared<const core::Sample>(std::move(made));
  const Validity validity = age > max_age ? Validity::stale : Validity::valid;
  return {std::move(sample), validity, std::max(age, Duration{}), max_age};
}

std::string Lighting::reason() const {
  switch (validity_) {
    case Validity::valid:
      return {};
    case Validity::stale:
      return formatted(
          "%.0f ms from the nearest descriptor (as far as the clocks are known: within %.3g ms), and max_age is %.0f "
          "ms",
          age_.milliseconds(), age_uncertainty().milliseconds(), max_age_.milliseconds());
    case Validity::none:
      return "no descriptor has come yet";
    case Validity::before_history:
      return "the moment lies before the oldest descriptor kept; ProbeOptions::history keeps more";
    case Validity::invalid_query:
      return "the rotation is zero or not finite, or the pose of the probe is unknown";
  }
  return {};
}

Duration Lighting::age_uncertainty() const { return sample_ ? sample_->time_uncertainty : Duration{}; }

const Descriptor& Lighting::descriptor() const { return sample_ ? sample_->descriptor : no_sample().descriptor; }

std::size_t Lighting::encoded_bytes() const { return sample_ ? sample_->encoded_bytes : 0; }
HostTime Lighting::mid_exposure() const { return sample_ ? sample_->mid_exposure : HostTime{}; }
HostTime Lighting::received() const { return sample_ ? sample_->received : HostTime{}; }

std::span<const Light> Lighting::lights() const { return descriptor().lights; }

std::optional<EnvironmentView> Lighting::environment() const {
  if (!sample_ || !sample_->environment) return std::nullopt;
  const core::EnvironmentSnapshot& kept = *sample_->environment;
  // A lamp that was switched off since the map must not stay in mirrors.
  const bool all_shine = std::ranges::all_of(kept.map.light_tracks, [this](std::uint32_t track) {
    return std::ranges::find(lights(), track, &Light::track) != lights().end();
  });
  return EnvironmentView{kept.map, sample_->environment_rotation, kept.sequence,
                         sample_->descriptor.time.mid_exposure - kept.mid_exposure,
                         kept.mirror.whole() && all_shine ? kept.mirror : kept.map};
}

std::optional<Light> Lighting::primary_light() const {
  if (lights().empty()) return std::nullopt;
  return lights().front();
}

template <class T>
Answer<T> Lighting::answer() const {
  Answer<T> out;
  out.validity = validity_;
  out.age = age_;
  out.error_bound = descriptor().bound.total;
  out.flags = descriptor().flags;
  return out;
}

Answer<Irradiance> Lighting::irradiance(Vec3f normal) const {
  auto out = answer<Irradiance>();
  if (!sample_) return out;
  if (!core::irradiance_one(sample_->irradiance, sample_->receiver_lights, normal, out.value))
    out.validity = Validity::invalid_query;
  return out;
}

Answer<std::size_t> Lighting::irradiance(std::span<const Vec3f> normals, std::span<Irradiance> out) const {
  auto answered = answer<std::size_t>();
  if (normals.size() != out.size()) {
    answered.validity = Validity::invalid_query;
    return answered;
  }
  if (!sample_) {
    std::fill(out.begin(), out.end(), Irradiance{});
    return answered;
  }
  answered.value = core::irradiance_rows(sample_->irradiance, sample_->receiver_lights, normals, out);
  if (answered.value > 0) answered.validity = Validity::invalid_query;
  return answered;
}

Answer<Radiance> Lighting::radiance(Vec3f direction, float perceptual_roughness) const {
  auto out = answer<Radiance>();
  const bool mirror = perceptual_roughness <= 0;
  if (mirror) out.lights = LightsIncluded::no;
  if (!sample_) return out;
  const Vec3f d = normalized(direction);
  if (d == kZero || !std::isfinite(perceptual_roughness)) {
    out.validity = Validity::invalid_query;
    return out;
  }
  const core::EnvironmentSnapshot* const kept = sample_->environment.get();
  const auto without_lights = [&](float roughness, const std::array<double, kMaxBand + 1>& lobe) {
    if (kept == nullptr) {
      const RadianceReconstruction* const ready = sample_->reconstruction->ready();
      return radiance_at(ready != nullptr ? *ready : sample_->reconstruction->compute(), d, roughness, lobe);
    }
    const Vec3f in_map = rotate(sample_->environment_rotation.inverse(), d);
    return environment_radiance(kept->map, in_map, roughness);
  };
  if (mirror) {
    out.value = without_lights(0, kMirror);
    return out;
  }
  constexpr auto smallest = static_cast<float>(GgxLobe::kMinRoughness);
  const RoughnessLobe& rough = lobe_of(std::clamp(perceptual_roughness, smallest, 1.0F));
  out.value = without_lights(rough.roughness, rough.band_factor);
  out.value += lights_radiance(sample_->descriptor.lights, direction, rough.lobe);
  if (kept != nullptr && kept->mirror.whole()) {
    const float share = first_level_share(kept->map.levels, rough.roughness);
    if (share > 0) out.value += shown_lights(*environment(), lights(), d, rough, share);
    for (int c = 0; c < 3; ++c) out.value[c] = std::max(out.value[c], 0.0F);  // Rounding.
  }
  return out;
}

const UncertainPose* Lighting::mounting() const { return sample_ ? sample_->T_world_probe.get() : nullptr; }

std::optional<Vec3d> Lighting::position(const Light& light) const { return light_position(light, origin()); }

Lighting Lighting::in_frame(const Pose& T_b_a) const {
  if (!sample_) return *this;
  const auto& [q, t] = T_b_a;
  const double norm2 = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  if (!(norm2 > 0) || !std::isfinite(norm2) || !is_finite(t)) return {nullptr, Validity::invalid_query, {}, max_age_};
  const Quat turn = q.normalized();
  core::Sample out = *sample_;
  out.descriptor.radiance = lightwell::rotated(out.descriptor.radiance, turn);
  for (Light& light : out.descriptor.lights) light = core::rotate_light(light, turn);
  out.descriptor.T_probe_origin = compose(Pose{turn, t}, out.descriptor.T_probe_origin);
  core::prepare(out);
  if (out.reconstruction)
    out.reconstruction = std::make_shared<const core::LazyReconstruction>(out.reconstruction, turn);
  out.descriptor.environment.reset();
  out.environment_rotation = turn * out.environment_rotation;
  out.T_world_probe.reset();
  return {std::make_shared<const core::Sample>(std::move(out)), validity_, age_, max_age_, derivation_};
}

Lighting Lighting::rotated(Quat q) const { return in_frame({q, {}}); }

Lighting Lighting::in_world(const Pose& T_world_probe) const { return in_frame(T_world_probe); }

Lighting Lighting::in_world(const UncertainPose& T_world_probe) const {
  Lighting turned = in_world(T_world_probe.pose);
  if (!turned.sample_) return turned;
  core::Sample out = *turned.sample_;
  const PoseCovariance& c = T_world_probe.covariance;
  const bool placed = std::isfinite(c[3][3]) && std::isfinite(c[4][4]) && std::isfinite(c[5][5]);
  for (Light& light : out.descriptor.lights) {
    light.direction_covariance = core::add_pose_noise(light, c);
    if (!placed) light.distance_m = light.distance_sigma_m = 0;
  }
  turned.sample_ = std::make_shared<const core::Sample>(std::move(out));
  return turned;
}

}  // namespace lightwell
