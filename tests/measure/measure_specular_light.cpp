// Measures the light that the specular estimator finds in rendered sequences of a glossy plane, against the environment
// that lit them: irradiance and its bound, lights, three balls. One JSON object per line.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/glossy_plane.hpp>
#include <lightwell/quantile.hpp>

#include "bench/memcpy_speed.hpp"
#include "bench/process_memory.hpp"
#include "bench/thread_time.hpp"
#include "estimate/specular/specular_estimator.hpp"
#include "measure/output.hpp"
#include "measure/specular_light_errors.hpp"
#include "tools/command_line.hpp"

namespace lightwell {
namespace {

namespace ref = reference;
using measure::in_world;
using measure::SpecularSequence;
using measure::TrueLight;

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kMapEdge = 64;
/// Every so many frames a descriptor is compared with the truth.
constexpr int kCompareEvery = 10;

/// The albedo of white in the textures of tests/reference.
constexpr double kWhiteAlbedo = 0.8;

/// `control`: of a descriptor that is made from the true environment.
void print_errors(const std::string& name, const measure::LightErrors& errors, const measure::LightErrors& control) {
  for (std::size_t n = 0; n < errors.lights.size(); ++n) {
    const measure::LightError& e = errors.lights[n];
    nlohmann::ordered_json line;
    line["sequence"] = name;
    line["light"] = n;
    line["relative_irradiance"] = e.relative_irradiance;
    line["error_deg"] = e.listed_deg;
    line["mirrored_error_deg"] = e.mirrored_deg;
    line["control_error_deg"] = control.lights[n].listed_deg;
    line["control_mirrored_error_deg"] = control.lights[n].mirrored_deg;
    line["sigma_deg"] = e.sigma_deg;
    measure::print_line(line);
  }
  for (std::size_t n = 0; n < errors.balls.size(); ++n) {
    nlohmann::ordered_json line;
    line["sequence"] = name;
    line["ball"] = measure::ball_name(measure::kComparedBalls[n]);
    line["si_rmse"] = errors.balls[n].linear.si_rmse;
    line["truth_rms"] = errors.balls[n].linear.truth_rms;
    line["si_rmse_published"] = errors.balls[n].published.si_rmse;
    line["si_rmse_both_blurred"] = errors.balls[n].both_blurred.si_rmse;
    line["control_si_rmse_published"] = control.balls[n].published.si_rmse;
    measure::print_line(line);
  }
}

/// Of an estimator with all defaults, from its making on.
void measure_memory(const measure::SpecularSequenceOptions& options) {
  const std::unique_ptr<SpecularSequence> sequence = require(SpecularSequence::make(options));
  SpecularOptions estimator_options;
  estimator_options.config.specular.environment_edge = kMapEdge;
  measure::Shot shot = sequence->frame(0);
  Descriptor d;
  bench::PeakMemory memory;
  std::unique_ptr<SpecularEstimator> estimator;
  memory.measure([&] {
    estimator = require(make_specular_estimator(sequence->rig(), measure::plane_of_sequence(),
                                                measure::make_sequence_finder(*sequence), estimator_options));
  });
  for (int k = 0; k < options.frames; ++k) {
    shot = sequence->frame(k);
    memory.measure([&] {
      require(estimator->estimate(shot.frames, d));
      (void)estimator->captured_plane();
    });
  }
  nlohmann::ordered_json line;
  line["sequence"] = options.name;
  line["peak_growth_mb"] = memory.growth_mb();
  line["light_field_mb"] = static_cast<double>(estimator->capture().light_field().bytes()) / 1e6;
  measure::print_line(line);
}

/// Repeats the light's part of a SpecularEstimator with an estimator of its own, to measure it apart from the frame.
class LightTimer {
 public:
  explicit LightTimer(const SpecularOptions& options, const specular::WhiteAlbedo& white)
      : operations_(options.light_operations), white_(white) {}

  /// After each frame.
  void follow(const SpecularEstimator& estimator) {
    if (estimator.capture().restarts() != restarts_) light_.emplace();
    restarts_ = estimator.capture().restarts();
    ++since_start_, ++age_;
    const double start = bench::thread_time_ms();
    if (light_->running()) {
      light_->step(operations_);
    } else if (estimator.estimating()) {
      const specular::ReflectanceSeparation& separation = estimator.capture().separation();
      light_->begin(separation.specular(), separation.diffuse(), white_, specular::RoughnessMode::track);
      since_start_ = 0;
    } else {
      if (light_->last() != nullptr) ages_.push_back(age_);
      return;
    }
    ms_.push_back(bench::thread_time_ms() - start);
    if (!light_->running()) {
      frames_.push_back(since_start_);
      age_ = since_start_;
    }
    if (light_->last() != nullptr) ages_.push_back(age_);
    if (light_->running() != estimator.estimating() ||
        (!light_->running() && light_->last()->misfit != estimator.gloss()->misfit))
      require(invalid_argument("the repeated estimate of the environment differs from the estimator's"));
  }
  /// Of the frames with a part of an estimate.
  [[nodiscard]] const std::vector<double>& ms() const { return ms_; }
  /// Of each finished estimate: frames from its start to its end.
  [[nodiscard]] const std::vector<double>& frames() const { return frames_; }
  /// Of each frame: frames since the start of the estimate that its descriptor has.
  [[nodiscard]] const std::vector<double>& ages() const { return ages_; }

 private:
  std::size_t operations_;
  specular::WhiteAlbedo white_;
  std::optional<specular::GlossEstimator> light_{std::in_place};
  std::vector<double> ms_, frames_, ages_;
  int since_start_ = 0, age_ = 0, restarts_ = 0;
};

enum class White { assumed, given };

void measure_sequence(const measure::SpecularSequenceOptions& options, White white) {
  const std::unique_ptr<SpecularSequence> made = require(SpecularSequence::make(options));
  const SpecularSequence& sequence = *made;
  SpecularOptions estimator_options;
  estimator_options.config.specular.environment_edge = kMapEdge;
  GlossyPlane plane = measure::plane_of_sequence();
  if (white == White::given) plane.white_albedo = kWhiteAlbedo;
  const std::unique_ptr<SpecularEstimator> estimator = require(
      make_specular_estimator(sequence.rig(), plane, measure::make_sequence_finder(sequence), estimator_options));
  // Radiance is relative to full scale at kExposure_s, as the environment's.
  estimator->set_scale({Units::relative, SpecularSequence::kExposure_s});

  const measure::LightTruth lights(measure::surroundings(sequence, options.frames - 1), options.alpha);
  const auto truth = measure::IrradianceTruth::of(lights.around());
  const Descriptor control = measure::described(lights.around());

  Descriptor d;
  int compared = 0, bounded = 0, held = 0, failed = 0, unsure = 0;
  std::vector<double> ratios, frame_ms, mahalanobis, mahalanobis_of_control, errors;
  LightTimer timer(estimator_options, white == White::given
                                          ? specular::WhiteAlbedo{kWhiteAlbedo, specular::kGivenAlbedoSigma}
                                          : specular::WhiteAlbedo());
  const double copy_ms = 1e3 * bench::memcpy_speed(sequence.frame(0).pixels.front().size()).seconds_per_copy;
  double last_error = 0;
  const auto compare = [&] {
    last_error = truth.error(d);
    const auto bound = static_cast<double>(d.bound.total);
    ++compared;
    if (!std::isfinite(bound)) return;
    ++bounded;
    held += last_error <= bound ? 1 : 0;
    errors.push_back(last_error);
    ratios.push_back(bound / std::max(last_error, 1e-9));
    // Flagged answers say themselves that directions may be wrong.
    unsure += d.flags.has(Flag::unsure) ? 1 : 0;
    if (d.flags.has(Flag::unsure)) return;
    const auto add = [&](const ref::V3& direction, std::vector<double>& out) {
      const Light* nearest = measure::nearest_light(d, direction);
      if (nearest == nullptr) return;
      const double angle = ref::angle_deg(in_world(d, nearest->direction), direction) * kDegree;
      const auto variance =
          static_cast<double>((nearest->direction_covariance[0] + nearest->direction_covariance[2]) / 2);
      // A light farther than a lobe was not found; print_errors() counts it.
      if (angle < lights.lobe_width_rad()) out.push_back(angle * angle / variance);
    };
    for (const TrueLight& t : lights.lights()) {
      add(t.direction, mahalanobis);
      const Light* listed = measure::nearest_light(control, t.direction);
      if (listed != nullptr) add(in_world(control, listed->direction), mahalanobis_of_control);
    }
  };
  for (int k = 0; k < options.frames; ++k) {
    const measure::Shot shot = sequence.frame(k);
    const double start = bench::thread_time_ms();
    const Status status = estimator->estimate(shot.frames, d);
    frame_ms.push_back(bench::thread_time_ms() - start);
    failed += status.ok() ? 0 : 1;
    timer.follow(*estimator);
    if (status.ok() && k % kCompareEvery == 0) compare();
  }
  nlohmann::ordered_json line;
  line["sequence"] = options.name;
  line["white"] = white == White::given ? "given" : "assumed";
  line["frames"] = options.frames;
  line["failed"] = failed;
  line["compared"] = compared;
  line["bounded"] = static_cast<double>(bounded) / std::max(compared, 1);
  line["held"] = bounded > 0 ? static_cast<double>(held) / bounded : 0;
  line["unsure"] = static_cast<double>(unsure) / std::max(bounded, 1);
  line["bound_to_error"] = ratios.empty() ? 0 : median(ratios);
  line["error_median"] = errors.empty() ? 0 : median(errors);
  line["mahalanobis_q95"] = mahalanobis.empty() ? 0 : upper_quantile(mahalanobis, 0.95);
  line["mahalanobis_of_control_q95"] =
      mahalanobis_of_control.empty() ? 0 : upper_quantile(mahalanobis_of_control, 0.95);
  line["ms"] = median(frame_ms);
  line["q95_ms"] = upper_quantile(frame_ms, 0.95);
  line["max_ms"] = *std::ranges::max_element(frame_ms);
  line["memcpy_ms"] = copy_ms;
  if (std::vector<double> ms = timer.ms(), frames = timer.frames(), ages = timer.ages(); !frames.empty()) {
    line["light_ms"] = median(ms);
    line["light_q95_ms"] = upper_quantile(ms, 0.95);
    line["light_max_ms"] = *std::ranges::max_element(ms);
    line["estimates"] = frames.size();
    line["estimate_frames"] = median(frames);
    line["estimate_max_frames"] = *std::ranges::max_element(frames);
    line["age_frames"] = median(ages);
    line["max_age_frames"] = *std::ranges::max_element(ages);
  }
  // The final answer, with all samples.
  estimator->finish();
  require(estimator->estimate(sequence.frame(options.frames - 1).frames, d));
  compare();
  line["final_error"] = last_error;
  line["final_bound"] = static_cast<double>(d.bound.total);
  for (const Flag f : kFlags)
    if (d.flags.has(f)) line["flags"].push_back(to_string(f));
  line["alpha"] = estimator->gloss()->alpha;
  line["true_alpha"] = options.alpha;
  line["seen"] = estimator->gloss()->seen;
  line["scale_sigma"] = estimator->gloss()->scale_sigma;
  line["lights"] = d.lights.size();
  measure::print_line(line);
  print_errors(options.name, lights.errors(d), lights.errors(control));
}

}  // namespace
}  // namespace lightwell

int main(int argc, char** argv) {
  using namespace lightwell;
  std::vector<std::string> names;
  std::string frames;
  double shorter = 1;
  bool white_given = false, memory = false;
  CLI::App app{"Errors of the light that is estimated from glossy planes.", "measure_specular_light"};
  app.add_option("--sequence", names, "Sequences to measure; several may be given [all]")
      ->check(CLI::IsMember(measure::sequence_names()));
  app.add_option("--shorter", shorter, "Divide the number of frames by this [1]")->check(CLI::Range(1.0, 100.0));
  app.add_flag("--white-given", white_given, "The plane's file has the albedo of white");
  app.add_flag("--memory", memory, "Measure the growth of the estimator's memory instead, with the first sequence");
  app.add_option("--frames", frames, "Keep rendered frames in this folder, and read those that are in it [render all]")
      ->check(CLI::ExistingDirectory);
  app.footer("A sequence takes one to three minutes. Exit status: 0 measured, 1 failed, 2 wrong usage.");
  return run_command(app, {argv + 1, argv + argc}, [&] {
    if (names.empty()) names = measure::sequence_names();
    for (const std::string& name : names) {
      measure::SpecularSequenceOptions options = require(measure::sequence_options(name));
      options.frames = static_cast<int>(options.frames / shorter);
      options.frames_folder = frames;
      if (memory) {
        measure_memory(options);
        break;
      }
      measure_sequence(options, white_given ? White::given : White::assumed);
    }
    return kDone;
  });
}
