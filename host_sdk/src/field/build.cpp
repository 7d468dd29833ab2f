#include "field/build.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <lightwell/quantile.hpp>
#include <lightwell/text.hpp>

#include "field/match.hpp"
#include "field/place.hpp"
#include "field/residual.hpp"
#include "field/scale.hpp"
#include "field/views.hpp"

namespace lightwell::field {
namespace {

constexpr Duration kClockSlack{50'000'000};
// A factor is known where its logarithm is within kScaleSigma; an absolute probe's may be at most kLargestFactor.
constexpr double kScaleSigma = 0.5, kLargestFactor = 2.5;
// Of the logarithm of an absolute probe's factor: what is expected of a calibration, and what the lights alone say.
constexpr double kAbsoluteSigma = 0.1, kFreeSigma = 1;
// Lights below this share of the strongest do not count against a probe's pose.
constexpr double kMinorLight = 0.05;
constexpr double kSameLight_m = 0.3, kSameLight_rad = 0.1;

/// The views that take part, and what became of all samples.
struct Build {
  std::vector<ProbeView> views;
  std::vector<std::size_t> sample_of;  ///< Of each view, its sample.
  std::vector<Observation> observations;
  LightMatches matches;
  std::vector<Placed> lights;

  void match() {
    observations = observations_of(views);
    matches = match_lights(views, observations);
    lights = place_lights(views, observations, matches.groups);
  }
};

void mark(FieldProbe& probe, FieldProbeState state, std::string reason) {
  probe.state = state;
  probe.reason = std::move(reason);
}

void erase_views(Build& build, const std::vector<bool>& erased) {
  std::size_t kept = 0;
  for (std::size_t v = 0; v < build.views.size(); ++v) {
    if (erased[v]) continue;
    if (kept != v) {
      build.views[kept] = std::move(build.views[v]);
      build.sample_of[kept] = build.sample_of[v];
    }
    ++kept;
  }
  build.views.resize(kept);
  build.sample_of.resize(kept);
}

/// Leaves out samples that are too old or from the future.
Build usable_views(const std::vector<NamedSample>& samples, const FieldOptions& options, HostTime now,
                   std::vector<FieldProbe>& probes) {
  Build out;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const FieldSample& s = samples[i].sample;
    ProbeView view = view_of(s);
    FieldProbe& probe = probes.emplace_back();
    probe.name = samples[i].name;
    probe.position = view.origin;
    probe.lights = static_cast<std::uint32_t>(s.light.lights.size());
    const Duration age = now - s.mid_exposure;
    if (age + s.time_uncertainty + kClockSlack < Duration{}) {
      mark(probe, FieldProbeState::wrong_clock,
           formatted("its mid-exposure is %.3g s in the future: check its clock", -age.seconds()));
    } else if (age - s.time_uncertainty > options.drop_age) {
      mark(probe, FieldProbeState::expired, formatted("its last sample is %.3g s old", age.seconds()));
    } else {
      if (age + s.time_uncertainty > options.max_age)
        mark(probe, FieldProbeState::stale, formatted("its last sample is %.3g s old", age.seconds()));
      out.views.push_back(std::move(view));
      out.sample_of.push_back(i);
    }
  }
  const bool one_calibration = std::ranges::all_of(
      out.views, [&](const ProbeView& v) { return v.calibration == out.views.front().calibration; });
  for (ProbeView& view : out.views) view.scale_known = one_calibration;
  return out;
}

/// Brings the views to a common scale. True if views were left out or scales changed so that matching changes.
bool align_scales(Build& build, std::vector<FieldProbe>& probes) {
  if (build.views.size() < 2) return false;
  const auto scales = estimate_scales(build.views, build.observations, build.lights, kAbsoluteSigma);
  const auto free_scales = estimate_scales(build.views, build.observations, build.lights, kFreeSigma);
  // What an absolute probe's factor is compared with: that of the majority.
  std::vector<double> absolute;
  for (std::size_t v = 0; v < build.views.size(); ++v)
    if (build.views[v].absolute) absolute.push_back(free_scales[v].log_scale);
  const double common = absolute.empty() ? 0 : lower_quantile(absolute, 0.5);
  const auto agrees = [&](double log_scale) { return std::abs(log_scale - common) <= std::log(kLargestFactor); };
  const bool majority = 2 * std::ranges::count_if(absolute, agrees) > std::ssize(absolute);
  std::vector<bool> erased(build.views.size());
  bool changed = false;
  for (std::size_t v = 0; v < build.views.size(); ++v) {
    ProbeView& view = build.views[v];
    FieldProbe& probe = probes[build.sample_of[v]];
    const double factor = std::exp(scales[v].log_scale), free_factor = std::exp(free_scales[v].log_scale - common);
    if (view.absolute && !agrees(free_scales[v].log_scale)) {
      mark(probe, FieldProbeState::wrong_scale,
           formatted("its lights are %.3g times those of the other probes, and its units are absolute: check its "
                     "photometric calibration",
                     1 / free_factor));
      erased[v] = changed = true;
    } else if (!view.absolute && !(scales[v].sigma < kScaleSigma)) {
      mark(probe, FieldProbeState::wrong_scale,
           "its units are relative, and it shares no light with the other probes that fixes their factor: calibrate "
           "it, or place it where it sees a lamp that they see");
      erased[v] = changed = true;
    } else {
      changed = changed || !view.scale_known;
      view.scale = probe.scale = factor;
      view.scale_known = true;
      if (view.absolute && !majority)
        mark(probe, FieldProbeState::contradicted,
             "as many probes measured light of another scale: check the photometric calibration of all");
    }
  }
  erase_views(build, erased);
  return changed;
}

/// Leaves out a view none of whose lights meet those of the others, although at least two others agree on two lights.
bool leave_out_wrong_poses(Build& build, std::vector<FieldProbe>& probes) {
  if (build.views.size() < 3 || build.lights.size() < 2) return false;
  std::vector<std::size_t> matched(build.views.size()), major(build.views.size());
  double strongest = 0;
  for (const Observation& o : build.observations) strongest = std::max(strongest, o.luminance);
  for (const Observation& o : build.observations) major[o.view] += o.luminance > kMinorLight * strongest ? 1 : 0;
  for (const Placed& light : build.lights)
    for (const std::size_t m : light.members) ++matched[build.observations[m].view];
  std::vector<bool> erased(build.views.size());
  bool changed = false;
  for (std::size_t v = 0; v < build.views.size(); ++v) {
    if (matched[v] > 0 || major[v] < 2) continue;
    erased[v] = changed = true;
    mark(probes[build.sample_of[v]], FieldProbeState::wrong_pose,
         formatted("none of its %zu lights is where the other probes see one: check its pose", major[v]));
  }
  if (changed) erase_views(build, erased);
  return changed;
}

/// The normal of the geometry in whose surface a light is: too close to it for a ball of the light's radius.
std::optional<Vec3d> surface_under(const Build& build, const Placed& light, const Proxy* proxy) {
  if (proxy == nullptr || light.distant) return std::nullopt;
  const double sigma = std::sqrt((light.covariance[0] + light.covariance[3] + light.covariance[5]) / 3);
  const double reach = std::max(0.5 * light.radius, 2 * sigma);
  for (const std::size_t m : light.members)
    if (const auto normal = proxy->surface_at(light.position, build.observations[m].origin, reach)) return normal;
  return std::nullopt;
}

void fit_intensities(Build& build, const Proxy* proxy) {
  constexpr double kIrradianceSigma = 0.05;
  for (Placed& light : build.lights) {
    std::vector<IntensityObservation> seen;
    for (const std::size_t m : light.members) {
      const Observation& o = build.observations[m];
      const Irradiance e =
          build.views[o.view].lights[o.light].irradiance * static_cast<float>(build.views[o.view].scale);
      if (light.distant) {
        seen.push_back({{}, e, kIrradianceSigma});
        continue;
      }
      const Vec3d to = light.position - o.origin;
      const double distance = std::max(length(to), 1e-3);
      const Vec3d direction = to * (1 / distance);
      const double along = std::sqrt(std::max(quadratic(light.covariance, direction, direction), 0.0));
      seen.push_back({-direction, e * static_cast<float>(distance * distance),
                      std::hypot(kIrradianceSigma, 2 * along / distance)});
    }
    light.intensity = light.distant ? uniform_intensity(seen) : fit_intensity(seen, surface_under(build, light, proxy));
  }
  std::ranges::stable_sort(build.lights, std::greater<>{}, [&](const Placed& light) {
    double best = 0;
    for (const std::size_t m : light.members) best = std::max(best, build.observations[m].luminance);
    return best;
  });
  if (build.lights.size() > kMaxLights) build.lights.resize(kMaxLights);
}

std::vector<SharedLight> shared_lights(const Build& build, const FieldSnapshot* before) {
  std::vector<SharedLight> out;
  std::uint32_t next = 1;
  std::vector<bool> taken(before != nullptr ? before->lights.size() : 0);
  if (before != nullptr)
    for (const SharedLight& light : before->lights) next = std::max(next, light.id + 1);
  for (const Placed& placed : build.lights) {
    SharedLight light;
    light.distant = placed.distant;
    light.position = placed.position;
    light.covariance = placed.covariance;
    light.direction = placed.direction;
    light.direction_sigma_rad = placed.direction_sigma_rad;
    light.parallax_sigma = placed.parallax_sigma;
    light.radius = placed.radius;
    light.intensity = placed.intensity;
    for (const std::size_t m : placed.members)
      light.center += build.observations[m].origin * (1.0 / static_cast<double>(placed.members.size()));
    std::size_t same = taken.size();
    double nearest = 1;
    for (std::size_t k = 0; k < taken.size(); ++k) {
      const SharedLight& old = before->lights[k];
      if (taken[k] || old.distant != light.distant) continue;
      const double gap = light.distant ? angle_between(old.direction, light.direction) / kSameLight_rad
                                       : length(old.position - light.position) / kSameLight_m;
      if (gap < nearest) nearest = gap, same = k;
    }
    if (same < taken.size()) taken[same] = true;
    light.id = same < taken.size() ? before->lights[same].id : next++;
    out.push_back(light);
  }
  return out;
}

FieldLight reported(const SharedLight& light, const Placed& placed) {
  FieldLight out;
  out.id = light.id;
  out.placed = !light.distant;
  out.position = light.position;
  out.position_covariance = light.covariance;
  if (light.distant) {
    out.direction = vec_cast<float>(light.direction);
    out.direction_sigma_rad = static_cast<float>(light.direction_sigma_rad);
  }
  out.intensity = light.intensity.mean;
  out.intensity_gradient = light.intensity.gradient;
  out.radius = static_cast<float>(light.radius);
  out.probes = static_cast<std::uint32_t>(placed.members.size());
  return out;
}

FieldNode node_of(const FieldSample& sample, const ProbeView& view, const FieldProbe& probe) {
  FieldNode out;
  out.contradicted = probe.state == FieldProbeState::contradicted;
  out.position = view.origin;
  out.bound = sample.light.bound.total;
  out.flags = sample.light.flags;
  out.setting = sample.light.setting;
  out.mid_exposure = sample.mid_exposure;
  out.time_uncertainty = sample.time_uncertainty;
  return out;
}

}  // namespace

std::shared_ptr<const FieldSnapshot> build_field(const std::vector<NamedSample>& samples, const FieldOptions& options,
                                                 std::shared_ptr<const Proxy> proxy, const FieldSnapshot* before,
                                                 HostTime now) {
  auto state = std::make_shared<FieldState>();
  auto out = std::make_shared<FieldSnapshot>();
  out->options = options;
  Build build = usable_views(samples, options, now, state->probes);
  build.match();
  // Wrong poses first: their false matches must not decide scales.
  if (leave_out_wrong_poses(build, state->probes)) build.match();
  constexpr int kRounds = 4;  // Whom one round leaves out bends the factors of the others in that round alone.
  for (int round = 0; round < kRounds && align_scales(build, state->probes); ++round) build.match();
  fit_intensities(build, proxy.get());

  out->lights = shared_lights(build, before);
  std::vector<std::vector<std::size_t>> members;
  for (std::size_t l = 0; l < out->lights.size(); ++l) {
    state->lights.push_back(reported(out->lights[l], build.lights[l]));
    members.push_back(build.lights[l].members);
    for (const std::size_t m : members.back()) ++state->probes[build.sample_of[build.observations[m].view]].matched;
  }
  for (const std::size_t m : build.matches.ambiguous)
    ++state->probes[build.sample_of[build.observations[m].view]].ambiguous;
  for (std::size_t v = 0; v < build.views.size(); ++v)
    out->nodes.push_back(
        node_of(samples[build.sample_of[v]].sample, build.views[v], state->probes[build.sample_of[v]]));
  split_residuals(build.views, build.observations, members, proxy.get(), out->lights, out->nodes);
  out->surround = subtract_surround(std::move(proxy), build.views, out->nodes);
  out->variogram = estimate_variogram(options, out->surround != nullptr, out->lights, out->nodes);
  for (std::size_t v = 0; v < build.views.size(); ++v) {
    FieldProbe& probe = state->probes[build.sample_of[v]];
    if (out->nodes[v].contradicted && probe.state != FieldProbeState::contradicted)
      mark(probe, FieldProbeState::contradicted,
           "a probe less than a metre away measured another light: check both poses, clocks and calibrations");
  }
  const bool absolute = std::ranges::any_of(build.views, &ProbeView::absolute);
  state->units = absolute ? Units::absolute : Units::relative;
  state->updates = before != nullptr ? before->state->updates + 1 : 1;
  out->state = std::move(state);
  return out;
}

}  // namespace lightwell::field
