// Processing time of a frame with a marker in view, on one thread: a path-traced frame of 1280x960 from a camera at
// rest, with new noise in each frame; CPU time of the thread. Prints one JSON object per line for tests/figures
// (figure, value), each the best of five runs:
//   marker_speed.fps                        frames per second from the camera's bytes to the descriptor, while tracking
//   marker_speed.ms_detection_and_pose, .ms_sampling, .ms_light, .ms_all     milliseconds per frame, while tracking
//   marker_speed.ms_first                   first frame, with a full search for body and lights
//   marker_speed.ms_apriltag                AprilTag's own detection in the whole frame at its default half resolution
//   marker_speed.memcpy_gb_per_s, .ms_memcpy      copying the frame
// With --count N it processes N frames and prints nothing: the program for tests/measure/count_instructions.
//   measure_marker_speed [--count N] [--frame NAME] [--frames FOLDER] [--bodies FOLDER] [--still FOLDER]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/tag_body_finder.hpp"
#include "bench/memcpy_speed.hpp"
#include "bench/thread_time.hpp"
#include "estimate/marker/marker_estimator.hpp"
#include "estimate/marker/shading.hpp"
#include "imaging/image_file.hpp"
#include "measure/output.hpp"
#include "measure/traced_frames.hpp"
#include "pose/tag_detector.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;

constexpr int kFrames = 30, kRuns = 5;

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "measure_marker_speed: %s\n", what.c_str());
  std::exit(1);
}

/// A BodyFinder that measures its time.
class TimedFinder final : public BodyFinder {
 public:
  TimedFinder(std::unique_ptr<BodyFinder> finder, double& spent) : finder_(std::move(finder)), spent_(spent) {}
  void set_decimation(const FinderDecimation& decimation) override { finder_->set_decimation(decimation); }
  Result<std::optional<DetectedBody>> find(const View& view, const FrameInfo& info) override {
    const double begin = bench::thread_time_ms();
    auto found = finder_->find(view, info);
    spent_ += bench::thread_time_ms() - begin;
    return found;
  }

 private:
  std::unique_ptr<BodyFinder> finder_;
  double& spent_;
};

/// Writes picture.png and camera.textproto into `folder`. A distortion of 0.02 px and vignetting of 0.2 % are added, so
/// that as much is computed as for a real lens.
void write_still(const std::string& folder, RigParameters rig, const measure::Shot& shot) {
  std::get<MeiParameters>(rig.lenses[0].model).k1 = 1e-4;
  rig.lenses[0].photometry.vignetting[0] = -0.01;
  const View& view = shot.frames.front().views().front();
  const Status picture =
      write_png(folder + "/picture.png", {view.width, view.height, view.format, shot.pixels.front()});
  const Status camera = write_output(folder + "/camera.textproto", calibration_to_text(rig));
  if (!picture.ok() || !camera.ok()) fail(picture.ok() ? camera.message() : picture.message());
}

struct Times {
  double first = 1e9, all = 1e9, finding = 1e9, sampling = 1e9, apriltag = 1e9;
};

/// Estimates the light in the k-th frame of a camera at rest.
void process(MarkerEstimator& estimator, std::vector<measure::Shot>& shots, int k, Descriptor& out) {
  measure::Shot& shot = shots[static_cast<std::size_t>(k) % shots.size()];
  shot.frames.front().info.mid_exposure = ProbeTime{(k + 1) * 16'666'667LL};
  if (const Status s = estimator.estimate(shot.frames, out); !s.ok()) fail(s.message());
  if (k > 0 && !estimator.report().light.tracked)
    std::fprintf(stderr, "measure_marker_speed: frame %d was searched instead of tracked\n", k);
}

/// Time of AprilTag's own detection in the green channel, ms.
double apriltag_ms(const measure::Shot& shot) {
  TagDetectorOptions options;
  options.corners = CornerRefinement::none;
  auto detector = TagDetector::make(options);
  if (!detector) fail(detector.status().message());
  const View& view = shot.frames.front().views().front();
  std::vector<std::uint8_t> green(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
  for (std::size_t i = 0; i < green.size(); ++i) green[i] = std::to_integer<std::uint8_t>(view.data[3 * i + 1]);
  const GreyPicture picture{green, view.width, view.height, static_cast<std::size_t>(view.width)};
  const DetectionWindow window{.region = {0, 0, view.width, view.height}, .decimate = 2};
  const double begin = bench::thread_time_ms();
  const auto found = detector->detect_in(picture, window);
  const double spent = bench::thread_time_ms() - begin;
  if (!found || found->empty()) fail("AprilTag finds no tag");
  return spent;
}

}  // namespace

int main(int argc, char** argv) {
  std::string frames_folder = LIGHTWELL_MARKER_FRAMES, bodies_folder = LIGHTWELL_MARKER_BODIES,
              name = "extra_large_straight_grey", still_folder;
  int count = 0;
  CLI::App app{"Processing time of a frame with a marker in view, on one thread.", "measure_marker_speed"};
  app.add_option("--frame", name, "The image [extra_large_straight_grey]");
  app.add_option("--frames", frames_folder, "Folder of scenes.json and the images [tests/reference/mitsuba/marker]");
  app.add_option("--bodies", bodies_folder, "Folder of the marker bodies [firmware/estimate/marker/bodies]");
  app.add_option("--count", count, "Process N frames and print nothing, to count instructions [no]")
      ->check(CLI::PositiveNumber);
  app.add_option("--still", still_folder,
                 "Write the first frame there as picture.png, and its camera.textproto, for lightwell-estimate [no]");
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  const auto frames = measure::load_traced_frames(frames_folder);
  if (!frames) fail(frames.status().message());
  const auto frame = std::find_if(frames->begin(), frames->end(), [&](const auto& f) { return f.name == name; });
  if (frame == frames->end()) fail("no frame " + name);
  const auto body = load_marker_body(bodies_folder + "/dodecahedron_100mm_" + frame->body + ".textproto");
  if (!body) fail(body.status().message());
  const auto picture = measure::TracedPicture::load(frames_folder, *frame, *body);
  if (!picture) fail(picture.status().message());
  measure::TracedSensor sensor;
  sensor.srgb = true;
  const RigParameters rig = picture->rig_for(sensor);
  std::vector<measure::Shot> shots;
  for (int k = 0; k < 6; ++k) shots.push_back(picture->expose(sensor, static_cast<std::uint64_t>(k)));
  if (!still_folder.empty()) write_still(still_folder, rig, shots.front());

  double finding = 0;
  Descriptor out;
  const auto new_estimator = [&] {
    Result<std::unique_ptr<BodyFinder>> plain = make_tag_body_finder(rig, *body);
    if (!plain) fail(plain.status().message());
    auto estimator = make_marker_estimator(rig, *body, std::make_unique<TimedFinder>(std::move(*plain), finding), {});
    if (!estimator) fail(estimator.status().message());
    return std::move(*estimator);
  };
  if (count > 0) {
    const auto estimator = new_estimator();
    for (int k = 0; k < count; ++k) process(*estimator, shots, k, out);
    return 0;
  }
  Times best;
  for (int run = 0; run < kRuns; ++run) {
    const auto estimator = new_estimator();
    double all = 0, first = 0;
    for (int k = 0; k < kFrames; ++k) {
      const double begin = bench::thread_time_ms();
      process(*estimator, shots, k, out);
      const double spent = bench::thread_time_ms() - begin;
      (k == 0 ? first : all) += spent;
      if (k == 0) finding = 0;
    }
    best.first = std::min(best.first, first);
    best.all = std::min(best.all, all / (kFrames - 1));
    best.finding = std::min(best.finding, finding / (kFrames - 1));

    best.apriltag = std::min(best.apriltag, apriltag_ms(shots.front()));
    estimate::RowReader reader(rig);
    marker::MarkerSampler sampler(rig.lenses[0].width, {});
    const CameraModel model(rig.lenses[0]);
    marker::Shading shading;
    const double begin = bench::thread_time_ms();
    for (int k = 0; k < kFrames; ++k) {
      if (!reader.bind(shots[static_cast<std::size_t>(k) % shots.size()].frames).ok()) fail("the frame cannot be read");
      const marker::PosedBody placed(*body, rig.lenses[0], model, estimator->report().body.probe_body.pose);
      (void)sampler.sample(reader, 0, rig.lenses[0].width, rig.lenses[0].height, *body, placed, 1, 0, 3, shading);
      marker::estimate_ground_reflection(shading);
    }
    best.sampling = std::min(best.sampling, (bench::thread_time_ms() - begin) / kFrames);
  }
  const bench::MemcpySpeed copy = bench::memcpy_speed(1280 * 960 * 3);
  const auto print = [](const std::string& figure, double value) {
    measure::print_figure("marker_speed." + figure, value);
  };
  print("fps", 1000 / best.all);
  print("ms_all", best.all);
  print("ms_detection_and_pose", best.finding);
  print("ms_sampling", best.sampling);
  print("ms_light", best.all - best.finding - best.sampling);
  print("ms_first", best.first);
  print("ms_apriltag", best.apriltag);
  print("memcpy_gb_per_s", copy.gigabytes_per_s);
  print("ms_memcpy", 1000 * copy.seconds_per_copy);
  return 0;
}
