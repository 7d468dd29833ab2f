// What limits the light that is estimated from a glossy plane: the same sequences with single causes of error removed,
// by the truth that the renderer knows. One JSON object per line.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "estimate/specular/gloss_estimate.hpp"
#include "estimate/specular/plane_capture.hpp"
#include "measure/output.hpp"
#include "measure/plane_views.hpp"
#include "measure/specular_light_errors.hpp"
#include "tools/command_line.hpp"

namespace lightwell {
namespace {

namespace ref = reference;
using measure::SpecularSequence;
using measure::SpecularSequenceOptions;

constexpr int kSweeps = 3;

/// The reflection and the texture of which the light is estimated.
struct Captured {
  specular::Lumisphere specular;
  specular::TexelImage diffuse;
};

enum class Poses { refined, exact };

/// Captures the whole sequence.
std::unique_ptr<specular::PlaneCapture> capture(const SpecularSequence& sequence, Poses poses) {
  specular::CaptureOptions options;
  options.refine_pose = poses == Poses::refined;
  auto out = std::make_unique<specular::PlaneCapture>(sequence.rig(), options);
  estimate::RowReader reader(sequence.rig());
  for (int k = 0; k < sequence.options().frames; ++k) {
    const measure::Shot shot = sequence.frame(k);
    require(reader.bind(shot.frames));
    UncertainPose pose = sequence.tag_pose(k);
    if (poses == Poses::exact) pose.pose = sequence.true_pose(k);
    (void)out->add(reader, 0, pose, static_cast<std::uint32_t>(k), SpecularSequence::kExposure_s);
  }
  out->solve(kSweeps);
  return out;
}

Captured of(const specular::PlaneCapture& capture) {
  return {capture.separation().specular(), capture.separation().diffuse()};
}

Radiance radiance_of(const ref::Rgb& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

/// With the true reflection in all directions that have a weight, not clipped, and the true texture.
Captured with_truth(const SpecularSequence& sequence, Captured captured) {
  const ref::GlossyScene& scene = sequence.scene();
  specular::Lumisphere& s = captured.specular;
  std::vector<float> seen[3];
  for (std::size_t node = 0; node < s.value.size(); ++node) {
    const Vec3d d = s.grid.direction(node);
    s.value[node] = radiance_of(scene.specular->radiance(ref::normalised({d.x, d.y, std::max(d.z, 1e-3)})));
    s.clipped[node] = 0;
    for (int c = 0; c < 3; ++c)
      if (s.weight[node] > 0) seen[c].push_back(s.value[node][c]);
  }
  // The separation's convention: the reflection is 0 at its 2 % quantile, the rest is in the texture.
  Radiance least;
  for (int c = 0; c < 3; ++c) {
    std::ranges::sort(seen[c]);
    least[c] = seen[c][seen[c].size() / 50];
  }
  for (Radiance& v : s.value) v = v - least;
  specular::fill_unseen(s);
  const specular::PlaneTexels texels{SpecularSequence::kPlane_m, 256};
  for (std::size_t texel = 0; texel < captured.diffuse.size(); ++texel) {
    const Vec3d p = texels.center(texel);
    ref::Rgb v = ref::albedo_at(scene.albedo, scene.size_m, p.x, p.y);
    for (std::size_t c = 0; c < 3; ++c) v[c] *= scene.irradiance[c] / ref::pi;
    const Radiance d = radiance_of(v) + least;
    captured.diffuse[texel] = {d.r, d.g, d.b, 0};
  }
  return captured;
}

Captured seen_everywhere(Captured captured) {
  std::ranges::fill(captured.specular.weight, 1.0F);
  std::ranges::fill(captured.specular.sigma, 0.0F);
  return captured;
}

/// In the plane's world axes.
ref::Panorama panorama_of(const specular::GlossEstimate& estimate) {
  ref::Panorama out{512, 256, {}};
  out.rgb.resize(static_cast<std::size_t>(3 * out.width * out.height));
  for (int j = 0; j < out.height; ++j)
    for (int i = 0; i < out.width; ++i) {
      const ref::V3 d = ref::plane_from_world(ref::pixel_direction(i, j, out.width, out.height));
      Radiance v = estimate.plane;
      if (d.z > 0) {
        const auto where = estimate.environment.grid.interpolate(vec_cast<float>(Vec3d{d.x, d.y, d.z}));
        v = {};
        for (std::size_t k = 0; k < 3; ++k) v += where.weight[k] * estimate.environment.radiance[where.node[k]];
      }
      ref::set_pixel(out, i, j, {static_cast<double>(v.r), static_cast<double>(v.g), static_cast<double>(v.b)});
    }
  return ref::cleaned(out);
}

void print(const std::string& sequence, const std::string& removed, const Descriptor& d,
           const measure::LightTruth& truth, const measure::IrradianceTruth& irradiance,
           const specular::GlossEstimate* estimate) {
  const measure::LightErrors errors = truth.errors(d);
  nlohmann::ordered_json line;
  line["sequence"] = sequence;
  line["case"] = removed;
  if (estimate != nullptr) {
    line["alpha"] = estimate->alpha;
    line["seen"] = estimate->seen;
    line["saturated"] = estimate->saturated;
    line["recovered"] = estimate->recovered;
    line["misfit"] = estimate->misfit;
  }
  line["irradiance_error"] = irradiance.error(d);
  line["listed_deg"] = errors.lights.front().listed_deg;
  line["mirrored_deg"] = errors.lights.front().mirrored_deg;
  for (std::size_t n = 0; n < errors.balls.size(); ++n)
    for (const auto& [suffix, error] :
         {std::pair{"", &errors.balls[n].published}, std::pair{", both blurred", &errors.balls[n].both_blurred}})
      line[std::string(measure::ball_name(measure::kComparedBalls[n])) + suffix] = error->si_rmse;
  measure::print_line(line);
}

void measure_sequence(const SpecularSequenceOptions& options) {
  const std::unique_ptr<SpecularSequence> sequence = require(SpecularSequence::make(options));
  const measure::LightTruth truth(measure::surroundings(*sequence, 0), options.alpha);
  const auto irradiance = measure::IrradianceTruth::of(truth.around());
  print(options.name, "true environment: description alone", measure::described(truth.around()), truth, irradiance,
        nullptr);
  const auto report = [&](const std::string& removed, const Captured& captured) {
    specular::GlossEstimator estimator;
    const specular::GlossEstimate* found = estimator.estimate(captured.specular, captured.diffuse, {});
    if (found == nullptr) return;
    print(options.name, removed, measure::described(panorama_of(*found)), truth, irradiance, found);
  };
  const Captured as_captured = of(*capture(*sequence, Poses::refined));
  report("as captured", as_captured);
  report("true poses", of(*capture(*sequence, Poses::exact)));
  report("true reflection in the seen directions, true texture", with_truth(*sequence, as_captured));
  report("true reflection in all directions, true texture", with_truth(*sequence, seen_everywhere(as_captured)));
  SpecularSequenceOptions unclipped = options;
  unclipped.format = PixelFormat::rgb_f32, unclipped.frames_folder.clear();
  report("no saturation, no noise", of(*capture(*require(SpecularSequence::make(unclipped)), Poses::refined)));
}

}  // namespace
}  // namespace lightwell

int main(int argc, char** argv) {
  using namespace lightwell;
  std::vector<std::string> names;
  std::string frames, environment;
  double shorter = 1;
  std::uint64_t seed = 0;
  CLI::App app{"What limits the light that is estimated from glossy planes.", "measure_specular_limits"};
  app.add_option("--sequence", names, "Sequences to measure; several may be given [all]")
      ->check(CLI::IsMember(measure::sequence_names()));
  app.add_option("--shorter", shorter, "Divide the number of frames by this [1]")->check(CLI::Range(1.0, 100.0));
  app.add_option("--seed", seed, "Seed of trajectory, texture and noise [that of the sequence]");
  app.add_option("--environment", environment, "Panorama that lights the plane [that of the sequence]")
      ->check(CLI::ExistingFile);
  app.add_option("--frames", frames, "Keep rendered frames in this folder, and read those that are in it [render all]")
      ->check(CLI::ExistingDirectory);
  app.footer("A sequence takes three minutes. Exit status: 0 measured, 1 failed, 2 wrong usage.");
  return run_command(app, {argv + 1, argv + argc}, [&] {
    if (names.empty()) names = measure::sequence_names();
    for (const std::string& name : names) {
      SpecularSequenceOptions options = require(measure::sequence_options(name));
      options.frames = static_cast<int>(options.frames / shorter);
      options.frames_folder = frames;
      if (seed > 0) options.seed = seed;
      if (!environment.empty()) options.environment = environment;
      measure_sequence(options);
    }
    return kDone;
  });
}
