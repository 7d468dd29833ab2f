// Measures what the specular estimator says of scenes that violate its assumptions, or that it cannot know: whether
// wrong answers are flagged. One JSON object per line.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/lighting.hpp>
#include <lightwell/quantile.hpp>

#include "estimate/specular/specular_estimator.hpp"
#include "measure/output.hpp"
#include "measure/panorama_sums.hpp"
#include "measure/specular_truth.hpp"
#include "tools/command_line.hpp"

namespace lightwell {
namespace {

namespace ref = reference;
using measure::SpecularSequence;
using measure::SpecularSequenceOptions;

/// Every so many frames a descriptor is compared with the truth.
constexpr int kCompareEvery = 5;
constexpr int kFrames = 450, kLightOut = 200;
/// 99.7 % quantile of chi-square with two degrees of freedom.
constexpr double kMaxMahalanobis = 11.83;

struct Extreme {
  std::string name;
  SpecularSequenceOptions options;
};

/// A frame of the office (perceptual roughness 0.32) unless stated otherwise; seeds are fixed.
std::vector<Extreme> extremes() {
  const SpecularSequenceOptions base = [] {
    SpecularSequenceOptions out = require(measure::sequence_options("office 0.45"));
    out.alpha = 0.1, out.seed = 31, out.frames = kFrames;
    return out;
  }();
  std::vector<Extreme> out;
  const auto add = [&](const std::string& name, const auto& change) {
    out.push_back({name, base});
    change(out.back().options);
    out.back().options.name = name;
    ++out.back().options.seed;
  };
  add("nothing extreme", [](SpecularSequenceOptions&) {});
  add("matte plane", [](SpecularSequenceOptions& o) { o.alpha = 0; });
  add("polished metal", [](SpecularSequenceOptions& o) {
    o.alpha = 0.02, o.fresnel = ref::FresnelTerm::kOne, o.albedo = ref::plain_texture(8, {0.02, 0.02, 0.02});
  });
  add("glossy and matte half", [](SpecularSequenceOptions& o) { o.right_alpha = 0; });
  add("halves of roughness 0.32 and 0.17", [](SpecularSequenceOptions& o) { o.right_alpha = 0.03; });
  add("strongest light goes out", [](SpecularSequenceOptions& o) { o.light_out_at = kLightOut; });
  add("views below 10 degrees", [](SpecularSequenceOptions& o) { o.highest_deg = 10, o.lowest_deg = 4, o.turns = 2; });
  add("pose jumps in a tenth of the frames", [](SpecularSequenceOptions& o) { o.jump_share = 0.1; });
  add("hand in a third of the frames", [](SpecularSequenceOptions& o) { o.hand_frames = 33; });
  add("page curled by 3 degrees", [](SpecularSequenceOptions& o) { o.curl = std::tan(3 / 180.0 * ref::pi); });
  add("exposure varies eightfold", [](SpecularSequenceOptions& o) { o.exposure_factor = 8; });
  add("no texture", [](SpecularSequenceOptions& o) { o.textured = false; });
  add("white at 2 % of full scale", [](SpecularSequenceOptions& o) { o.white = 0.02; });
  add("white at three times full scale", [](SpecularSequenceOptions& o) { o.white = 3; });
  return out;
}

bool is_finite(const Descriptor& d) {
  bool ok = !std::isnan(d.bound.total) && std::isfinite(d.coverage);
  const Lighting light = Lighting::of(d);
  for (const Vec3f n : {Vec3f{1, 0, 0}, Vec3f{0, 1, 0}, Vec3f{0, 0, -1}}) {
    const Irradiance e = light.irradiance(n).value;
    ok = ok && std::isfinite(e.r) && std::isfinite(e.g) && std::isfinite(e.b);
  }
  for (const Light& l : d.lights)
    ok =
        ok && std::isfinite(l.direction.x) && std::isfinite(l.irradiance.g) && std::isfinite(l.direction_covariance[0]);
  return ok;
}

/// What is right at a time of the sequence.
struct Truth {
  Truth(const SpecularSequence& sequence, int k)
      : around(measure::surroundings(sequence, k)), irradiance(measure::IrradianceTruth::of(around)) {
    const measure::PanoramaSums sums(around);
    const double alpha = std::max(sequence.options().alpha, 0.01);
    width = 2 * SpecularBrdf::half_width_rad(alpha);
    const double roughness = std::max(0.1, std::sqrt(alpha));
    lights = measure::true_lights(
        measure::mirrored_part(256, 128, [&](const ref::V3& d) { return sums.radiance(d, roughness); }), width);
  }
  /// Whether the descriptor's strongest light is none of the scene's, beyond its stated uncertainty.
  [[nodiscard]] bool has_false_light(const Descriptor& d) const {
    if (d.lights.empty()) return false;
    const Light& light = *std::ranges::max_element(
        d.lights, {}, [](const Light& l) { return luminance_of(l.irradiance.r, l.irradiance.g, l.irradiance.b); });
    const double variance = static_cast<double>(light.direction_covariance[0] + light.direction_covariance[2]) / 2;
    const ref::V3 found = measure::in_world(d, light.direction);
    return std::ranges::none_of(lights, [&](const measure::TrueLight& t) {
      const double angle = ref::angle_deg(t.direction, found) / 180 * ref::pi;
      return angle < width || angle * angle < kMaxMahalanobis * variance;
    });
  }

  ref::Panorama around;
  measure::IrradianceTruth irradiance;
  double width = 0;
  std::vector<measure::TrueLight> lights;
};

void measure_extreme(const Extreme& extreme) {
  const std::unique_ptr<SpecularSequence> sequence = require(SpecularSequence::make(extreme.options));
  const std::unique_ptr<SpecularEstimator> estimator = require(make_specular_estimator(
      sequence->rig(), measure::plane_of_sequence(), measure::make_sequence_finder(*sequence), {}));
  // Radiance is relative to full scale at kExposure_s, as the environment's.
  estimator->set_scale({Units::relative, SpecularSequence::kExposure_s});
  const Truth at_first(*sequence, 0), at_last(*sequence, extreme.options.frames - 1);

  int answers = 0, refused = 0, not_finite = 0, bounded = 0, sure = 0, held = 0, wrong = 0, false_lights = 0;
  int last_wrong = -1;
  double last_error = 0;
  std::vector<double> errors;
  Descriptor d;
  const auto compare = [&](int k) {
    const bool out = extreme.options.light_out_at && k >= *extreme.options.light_out_at;
    const Truth& truth = out ? at_last : at_first;
    ++answers;
    not_finite += is_finite(d) ? 0 : 1;
    last_error = truth.irradiance.error(d);
    const auto bound = static_cast<double>(d.bound.total);
    if (!std::isfinite(bound)) return;
    ++bounded;
    held += last_error <= bound ? 1 : 0;
    if (d.flags.has(Flag::unsure)) return;
    ++sure;
    errors.push_back(last_error);
    if (last_error > bound) ++wrong, last_wrong = k;
    if (truth.has_false_light(d)) ++false_lights, last_wrong = k;
  };
  for (int k = 0; k < extreme.options.frames; ++k) {
    const Status status = estimator->estimate(sequence->frame(k).frames, d);
    refused += status.ok() ? 0 : 1;
    if (status.ok() && k % kCompareEvery == 0) compare(k);
  }
  nlohmann::ordered_json line;
  line["extreme"] = extreme.name;
  line["frames"] = extreme.options.frames;
  line["refused"] = refused;
  line["answers"] = answers;
  line["not_finite"] = not_finite;
  line["bounded"] = bounded;
  line["held"] = held;
  line["sure"] = sure;
  line["error_of_sure"] = errors.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(median(errors));
  line["confidently_wrong"] = wrong;
  line["false_lights"] = false_lights;
  if (last_wrong >= 0) line["last_wrong_frame"] = last_wrong;
  line["restarts"] = estimator->capture().restarts();
  line["last_error"] = last_error;
  line["last_bound"] = static_cast<double>(d.bound.total);
  if (const specular::GlossEstimate* gloss = estimator->gloss()) {
    line["glossy"] = gloss->glossy;
    line["alpha"] = gloss->alpha;
    line["seen"] = gloss->seen;
    line["scale_sigma"] = gloss->scale_sigma;
    line["misfit"] = gloss->misfit;
  }
  line["flags"] = nlohmann::ordered_json::array();
  for (const Flag f : kFlags)
    if (d.flags.has(f)) line["flags"].push_back(to_string(f));
  measure::print_line(line);
}

}  // namespace
}  // namespace lightwell

int main(int argc, char** argv) {
  using namespace lightwell;
  std::vector<std::string> names;
  std::vector<Extreme> all = extremes();
  std::vector<std::string> known;
  for (const Extreme& e : all) known.push_back(e.name);
  CLI::App app{"Answers of the specular estimator where its assumptions do not hold.", "measure_specular_extremes"};
  app.add_option("--extreme", names, "Extremes to measure; several may be given [all]")->check(CLI::IsMember(known));
  app.footer("An extreme takes about a minute. Exit status: 0 measured, 1 failed, 2 wrong usage.");
  return run_command(app, {argv + 1, argv + argc}, [&] {
    for (const Extreme& e : all)
      if (names.empty() || std::ranges::find(names, e.name) != names.end()) measure_extreme(e);
    return kDone;
  });
}
