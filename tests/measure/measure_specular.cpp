// Measures the surface light field of glossy planes on rendered sequences: errors of re-rendered held-out views, and
// time. One JSON object per line.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include <lightwell/quantile.hpp>

#include "bench/memcpy_speed.hpp"
#include "bench/thread_time.hpp"
#include "estimate/specular/plane_capture.hpp"
#include "measure/output.hpp"
#include "measure/plane_views.hpp"
#include "measure/specular_sequences.hpp"
#include "tools/command_line.hpp"

namespace lightwell {
namespace {

using measure::SpecularSequence;
using measure::SpecularSequenceOptions;

/// How the poses of a capture are found.
enum class Poses { exact, noisy, refined };
constexpr std::array kPoses = {Poses::exact, Poses::noisy, Poses::refined};
const char* name_of(Poses poses) {
  return poses == Poses::exact ? "exact" : poses == Poses::noisy ? "noisy" : "refined";
}

specular::CaptureOptions options_of(Poses poses) {
  specular::CaptureOptions out;
  out.refine_pose = poses == Poses::refined;
  return out;
}

UncertainPose pose_of(const SpecularSequence& sequence, Poses poses, int frame) {
  UncertainPose out = sequence.tag_pose(frame);
  if (poses == Poses::exact) out.pose = sequence.true_pose(frame);
  return out;
}

constexpr int kSweeps = 3;

void print_errors(const std::string& sequence, const std::string& method, const measure::ViewErrors& errors) {
  nlohmann::ordered_json line;
  line["sequence"] = sequence;
  line["method"] = method;
  line["rmse"] = errors.rmse;
  line["rmse_seen"] = errors.rmse_seen;
  line["max_gradient_difference"] = errors.max_gradient_difference;
  line["saturated"] = errors.saturated;
  line["unseen"] = errors.unseen;
  measure::print_line(line);
}

/// With the light that is estimated from the whole capture.
measure::PlaneAppearance estimated_appearance(const specular::PlaneCapture& capture) {
  specular::GlossEstimator light;
  const specular::ReflectanceSeparation& separation = capture.separation();
  return measure::appearance_of(capture, light.estimate(separation.specular(), separation.diffuse(), {}));
}

/// Captures with exact, noisy and refined poses, of the same frames.
void measure_sequence(const SpecularSequenceOptions& options) {
  const std::unique_ptr<SpecularSequence> made = require(SpecularSequence::make(options));
  const SpecularSequence& sequence = *made;
  estimate::RowReader reader(sequence.rig());
  std::vector<std::unique_ptr<specular::PlaneCapture>> captures;
  for (const Poses poses : kPoses)
    captures.push_back(std::make_unique<specular::PlaneCapture>(sequence.rig(), options_of(poses)));
  std::vector<measure::RefinedFrame> stored;
  for (int k = 0; k < options.frames; ++k) {
    const measure::Shot shot = sequence.frame(k);
    require(reader.bind(shot.frames));
    for (std::size_t n = 0; n < captures.size(); ++n) {
      const auto frame = captures[n]->add(reader, 0, pose_of(sequence, kPoses[n], k), static_cast<std::uint32_t>(k),
                                          SpecularSequence::kExposure_s);
      if (kPoses[n] == Poses::refined && frame.stored) stored.push_back({k, frame.pose});
    }
  }
  std::vector<measure::HeldOutView> views = measure::held_out_views(sequence);
  std::vector<measure::PlaneAppearance> appearances;
  for (std::size_t n = 0; n < captures.size(); ++n) {
    specular::PlaneCapture& capture = *captures[n];
    // The seed's way with the same poses: medians, one lumisphere of 60 levels without interpolation or weights.
    print_errors(options.name, std::string("published, ") + name_of(kPoses[n]),
                 measure::view_errors(sequence, views, measure::published_appearance(capture)));
    capture.solve(kSweeps);
    appearances.push_back(estimated_appearance(capture));
    print_errors(options.name, std::string("ours, ") + name_of(kPoses[n]),
                 measure::view_errors(sequence, views, appearances.back()));
  }
  // The last capture is that of refined poses.
  print_errors(options.name, "ours, refined, neighbours in unseen directions",
               measure::view_errors(sequence, views, measure::appearance_of(*captures.back())));
  const measure::RefinementTruth truth = measure::refinement_truth(sequence, stored);
  measure::PlaneAppearance placed = appearances.back();
  const double alignment_error_mm = measure::distance_mm(placed.alignment, truth.alignment);
  placed.alignment = truth.alignment;
  print_errors(options.name, "ours, refined, at the true place", measure::view_errors(sequence, views, placed));
  const specular::SurfaceLightField& field = captures.back()->light_field();
  nlohmann::ordered_json line;
  line["sequence"] = options.name;
  line["frames"] = options.frames;
  line["stored"] = stored.size();
  line["alignment_error_mm"] = alignment_error_mm;
  line["variance_factor"] = truth.variance_factor;
  line["samples_per_texel"] = static_cast<double>(field.samples()) / static_cast<double>(field.texels().count());
  line["fill"] = field.fill();
  line["removed_samples"] = field.removed();
  measure::print_line(line);
}

/// Time of a frame, of one capture with refined poses.
void measure_speed(const SpecularSequenceOptions& options) {
  const std::unique_ptr<SpecularSequence> made = require(SpecularSequence::make(options));
  const SpecularSequence& sequence = *made;
  const measure::Shot first = sequence.frame(0);
  const std::vector<std::byte>& pixels = first.pixels.front();
  const bench::MemcpySpeed copy = bench::memcpy_speed(pixels.size());
  // The peer: the plane rectified to 256x256 by OpenCV, one thread.
  cv::setNumThreads(1);
  cv::Mat picture(options.height, options.width, CV_8UC3, const_cast<std::byte*>(pixels.data())), rectified;
  const cv::Point2f from[] = {{80, 60}, {560, 60}, {600, 420}, {40, 420}},
                    to[] = {{0, 0}, {256, 0}, {256, 256}, {0, 256}};
  const cv::Mat homography = cv::getPerspectiveTransform(from, to);
  std::vector<double> warp_ms, frame_ms;
  for (int k = 0; k < 50; ++k) {
    const double start = bench::thread_time_ms();
    cv::warpPerspective(picture, rectified, homography, {256, 256});
    warp_ms.push_back(bench::thread_time_ms() - start);
  }
  estimate::RowReader reader(sequence.rig());
  specular::PlaneCapture capture(sequence.rig(), options_of(Poses::refined));
  for (int k = 0; k < options.frames; ++k) {
    const measure::Shot shot = sequence.frame(k);
    const UncertainPose pose = sequence.tag_pose(k);
    const double start = bench::thread_time_ms();
    require(reader.bind(shot.frames));
    (void)capture.add(reader, 0, pose, static_cast<std::uint32_t>(k), SpecularSequence::kExposure_s);
    frame_ms.push_back(bench::thread_time_ms() - start);
  }
  nlohmann::ordered_json line;
  line["figure"] = "speed";
  line["ms"] = median(frame_ms);
  line["decile_ms"] = upper_quantile(frame_ms, 0.9);
  line["memcpy_ratio"] = median(frame_ms) / (1e3 * copy.seconds_per_copy);
  line["warp_perspective_ms"] = median(warp_ms);
  line["warp_perspective_ratio"] = median(frame_ms) / median(warp_ms);
  line["memcpy_gb_s"] = copy.gigabytes_per_s;
  line["samples_per_texel"] = static_cast<double>(capture.light_field().samples()) /
                              static_cast<double>(capture.light_field().texels().count());
  measure::print_line(line);
}

/// A capture with less than the defaults, and when it ends.
struct TradeCase {
  int levels = 60, texels = 256;
  int every = 1;    ///< Captures every so many frames.
  double fill = 1;  ///< Ends when this share of the light field is filled.
};

/// Times and errors of captures of the same sequence, in one pass over `order`, the numbers of its frames.
void measure_cases(const SpecularSequence& sequence, const std::string& figure, const std::vector<int>& order,
                   const std::vector<TradeCase>& cases, std::size_t max_bytes) {
  struct Run {
    std::unique_ptr<specular::PlaneCapture> capture;
    std::vector<double> ms;
    int stored = 0;
  };
  std::vector<Run> runs;
  for (const TradeCase& c : cases) {
    specular::CaptureOptions options;
    // The separation keeps its ratio of levels.
    options.levels = c.levels, options.lumisphere_levels = 2 * c.levels, options.texels.edge = c.texels;
    options.max_bytes = max_bytes;
    runs.push_back({std::make_unique<specular::PlaneCapture>(sequence.rig(), options), {}, 0});
  }
  estimate::RowReader reader(sequence.rig());
  for (std::size_t k = 0; k < order.size(); ++k) {
    const measure::Shot shot = sequence.frame(order[k]);
    require(reader.bind(shot.frames));
    for (std::size_t n = 0; n < cases.size(); ++n) {
      Run& run = runs[n];
      if (k % static_cast<std::size_t>(cases[n].every) != 0 || run.capture->light_field().fill() >= cases[n].fill)
        continue;
      const double start = bench::thread_time_ms();
      // Frames are numbered as a camera of this rate does.
      const auto frame = run.capture->add(reader, 0, sequence.tag_pose(order[k]),
                                          static_cast<std::uint32_t>(run.ms.size()), SpecularSequence::kExposure_s);
      run.ms.push_back(bench::thread_time_ms() - start);
      run.stored += frame.stored ? 1 : 0;
    }
  }
  std::vector<measure::HeldOutView> views = measure::held_out_views(sequence);
  for (std::size_t n = 0; n < cases.size(); ++n) {
    specular::PlaneCapture& capture = *runs[n].capture;
    nlohmann::ordered_json line;
    line["figure"] = figure;
    line["sequence"] = sequence.options().name;
    line["levels"] = cases[n].levels;
    line["texels"] = cases[n].texels;
    line["every"] = cases[n].every;
    line["frames"] = runs[n].ms.size();
    line["stored"] = runs[n].stored;
    line["ms"] = median(runs[n].ms);
    line["mb"] = static_cast<double>(capture.light_field().bytes()) / 1e6;
    line["fill"] = capture.light_field().fill();
    line["fill_limit"] = cases[n].fill;
    line["rmse_published_way"] = measure::view_errors(sequence, views, measure::published_appearance(capture)).rmse;
    capture.solve(kSweeps);
    const measure::ViewErrors errors = measure::view_errors(sequence, views, estimated_appearance(capture));
    line["rmse"] = errors.rmse;
    line["rmse_seen"] = errors.rmse_seen;
    line["unseen"] = errors.unseen;
    measure::print_line(line);
  }
}

/// Levels, texels and rate, one at a time.
void measure_trade(const SpecularSequenceOptions& options) {
  std::vector<int> order(static_cast<std::size_t>(options.frames));
  std::iota(order.begin(), order.end(), 0);
  measure_cases(*require(SpecularSequence::make(options)), "trade", order,
                {{60, 256}, {40, 256}, {20, 256}, {60, 128}, {60, 64}, {60, 256, 2}, {60, 256, 4}},
                specular::CaptureOptions{}.max_bytes);
}

/// The share of the light field that is filled, with memory for all samples.
void measure_fill(SpecularSequenceOptions options) {
  // A spiral of three times the frames, narrow enough for a fifth of the light field, in four passes: each is through
  // all directions, between the views of the earlier ones.
  options.frames *= 3;
  options.turns = 12;
  options.frames_folder.clear();  // No other program has these views.
  constexpr int kPasses = 4;
  std::vector<int> order;
  for (const int first : {0, 2, 1, 3})
    for (int k = first; k < options.frames; k += kPasses) order.push_back(k);
  measure_cases(*require(SpecularSequence::make(options)), "fill", order, {{60, 256, 1, 0.06}, {60, 256, 1, 0.2}},
                640U << 20U);
}

}  // namespace
}  // namespace lightwell

int main(int argc, char** argv) {
  using namespace lightwell;
  std::vector<std::string> names;
  std::string frames;
  bool speed = false, trade = false, fill = false;
  double shorter = 1;
  CLI::App app{"Errors of re-rendered views of glossy planes, time and memory of their capture.", "measure_specular"};
  app.add_option("--sequence", names, "Sequences to measure; several may be given [all]")
      ->check(CLI::IsMember(measure::sequence_names()));
  app.add_flag("--speed", speed, "Measure the time of a frame instead of errors, with the first sequence");
  app.add_flag("--trade", trade,
               "Measure time, memory and error for fewer levels, texels and frames, with the first sequence");
  app.add_flag("--fill", fill,
               "Measure the error by the share of the light field that is filled, with the first sequence");
  app.add_option("--shorter", shorter, "Divide the number of frames by this [1]")->check(CLI::Range(1.0, 100.0));
  app.add_option("--frames", frames, "Keep rendered frames in this folder, and read those that are in it [render all]")
      ->check(CLI::ExistingDirectory);
  app.footer("A sequence takes two to four minutes. Exit status: 0 measured, 1 failed, 2 wrong usage.");
  return run_command(app, {argv + 1, argv + argc}, [&] {
    if (names.empty()) names = measure::sequence_names();
    for (const std::string& name : names) {
      SpecularSequenceOptions options = require(measure::sequence_options(name));
      options.frames = static_cast<int>(options.frames / shorter);
      options.frames_folder = frames;
      if (speed) measure_speed(options);
      if (trade) measure_trade(options);
      if (fill) measure_fill(options);
      if (speed || trade || fill) break;
      measure_sequence(options);
    }
    return kDone;
  });
}
