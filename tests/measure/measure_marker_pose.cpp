// Time and accuracy of a body's pose: a dodecahedron of 10 cm in images of 1280x960, one thread. Prints one JSON object
// per line for tests/figures. Times are CPU times of the thread: the best of five for each image, then the mean over
// twelve attitudes.
//   marker_pose.tracked.*      an image in which the body is expected: track() and its parts, by the body's width
//   marker_pose.search.*       a first image, without a prediction; .no_body: without a body in the image
//   marker_pose.pose_only.*    find_body_pose from tags, with and without a prediction
//   marker_pose.part.D.WORK    the expected part only, decimated by D, by the method of corner refinement
// Accuracy, of poses that are not flagged: direction of the body's axes, deg; place, % of the distance; RMS and maximum
// over the twelve attitudes; normalized: mean of e' C⁻¹ e / 6.
//   measure_marker_pose [--quick]     two attitudes, to test the program
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "bench/memcpy_speed.hpp"
#include "bench/thread_time.hpp"
#include "firmware/pose/body_pictures.hpp"
#include "measure/output.hpp"
#include "pose/body_tracker.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;

constexpr int kRounds = 5;
double memcpy_gb_per_s = 0;

void print(const std::string& figure, double value, const char* unit) {
  measure::print_line(
      {{"figure", "marker_pose." + figure}, {"value", value}, {"unit", unit}, {"memcpy_gb_per_s", memcpy_gb_per_s}});
}

template <class Call>
double milliseconds(const Call& call) {
  const double start = bench::thread_time_ms();
  call();
  return bench::thread_time_ms() - start;
}

template <class Call>
double best(const Call& call) {
  double out = 1e9;
  for (int i = 0; i < kRounds; ++i) out = std::min(out, milliseconds(call));
  return out;
}

struct PosedPicture {
  Pose truth;
  reference::GreyBytes picture;
};

class Errors {
 public:
  void add(const BodyPose& found, const Pose& truth) {
    if (found.ambiguous) {
      ++flagged_;
      return;
    }
    const auto e = test::error_of(found.probe_body.pose, truth);
    const double turn = test::turn_of(e) / test::kDegree, place = 100 * test::shift_of(e) / length(truth.translation);
    turn_squares_ += turn * turn;
    place_squares_ += place * place;
    max_turn_ = std::max(max_turn_, turn);
    max_place_ = std::max(max_place_, place);
    Eigen::Matrix<double, 6, 6> c;
    Eigen::Matrix<double, 6, 1> v;
    for (std::size_t r = 0; r < 6; ++r) {
      v[static_cast<Eigen::Index>(r)] = e[r];
      for (std::size_t k = 0; k < 6; ++k)
        c(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(k)) = found.probe_body.covariance[r][k];
    }
    normalized_ += v.dot(c.ldlt().solve(v)) / 6;
    tags_ += found.used;
    rms_px_ += found.rms_px;
    ++count_;
  }

  void print_as(const std::string& figure) const {
    const double n = std::max(count_, 1);
    print(figure + ".flagged", flagged_, "");
    print(figure + ".found", count_, "");
    if (count_ == 0) return;
    print(figure + ".tags", tags_ / n, "");
    print(figure + ".rms_px", rms_px_ / n, "px");
    print(figure + ".direction_deg.rms", std::sqrt(turn_squares_ / n), "deg");
    print(figure + ".direction_deg.largest", max_turn_, "deg");
    print(figure + ".place_percent.rms", std::sqrt(place_squares_ / n), "%");
    print(figure + ".place_percent.largest", max_place_, "%");
    print(figure + ".normalized", normalized_ / n, "");
  }

 private:
  double turn_squares_ = 0, place_squares_ = 0, max_turn_ = 0, max_place_ = 0, normalized_ = 0, tags_ = 0, rms_px_ = 0;
  int count_ = 0, flagged_ = 0;
};

ProbeTime frame(int n) { return ProbeTime{n * 16'666'667LL}; }

std::vector<TagObservation> observations_of(const std::vector<TagDetection>& tags) {
  std::vector<TagObservation> out;
  for (const TagDetection& tag : tags) out.push_back({0, tag});
  return out;
}

/// Default options, but with an exactly known camera, so that the errors are those of the images only.
BodyTrackerOptions options_of(CornerRefinement corners) {
  BodyTrackerOptions options;
  options.corners = corners;
  options.pose.focal_sigma = 0;
  options.pose.face_turn_sigma_rad = options.pose.face_shift_sigma_m = 0;
  return options;
}

void measure_tracker(const RigParameters& rig, const MarkerBody& body, const std::vector<PosedPicture>& views,
                     const std::string& name) {
  BodyTracker tracker = std::move(*BodyTracker::make(body, rig, options_of(CornerRefinement::edge_search)));
  double first = 0, tracked = 0, share = 0, decimate = 0;
  int expected = 0;
  Errors errors;
  for (const PosedPicture& view : views) {
    first += best([&] {
      tracker.reset();
      (void)tracker.track(view.picture.view(), frame(0));
    });
    tracker.reset();
    int n = 0;
    for (int i = 0; i < 3; ++i) (void)tracker.track(view.picture.view(), frame(n++));
    Result<BodyObservation> last = tracker.track(view.picture.view(), frame(n++));
    if (!last->predicted || !last->pose) continue;
    ++expected;
    tracked += best([&] { last = tracker.track(view.picture.view(), frame(n++)); });
    share += static_cast<double>(last->region.width) * last->region.height / (view.picture.width * view.picture.height);
    decimate += last->decimate;
    if (last->pose) errors.add(*last->pose, view.truth);
  }
  print("search." + name + ".ms", first / static_cast<double>(views.size()), "ms");
  print("tracked." + name + ".expected", expected, "");
  if (expected == 0) return;
  print("tracked." + name + ".ms", tracked / expected, "ms");
  print("tracked." + name + ".share_of_picture", share / expected, "");
  print("tracked." + name + ".decimate", decimate / expected, "");
  errors.print_as("tracked." + name);
}

void measure_parts(const RigParameters& rig, const MarkerBody& body, const std::vector<PosedPicture>& views) {
  const std::vector<std::pair<CornerRefinement, const char*>> works = {{CornerRefinement::none, "none"},
                                                                       {CornerRefinement::edge_search, "followed"},
                                                                       {CornerRefinement::edge_fit, "fitted"}};
  const PosedLenses lenses(rig);
  double with = 0, without = 0;
  int poses = 0;
  for (const auto& [work, name] : works) {
    TagDetectorOptions detect;
    detect.corners = work;
    TagDetector detector = std::move(*TagDetector::make(detect));
    for (const double decimate : {1.0, 1.5, 2.0, 3.0, 4.0}) {
      double ms = 0, tags = 0;
      Errors errors;
      for (const PosedPicture& view : views) {
        BodyTracker tracker = std::move(*BodyTracker::make(body, rig, options_of(CornerRefinement::edge_search)));
        (void)tracker.track(view.picture.view(), frame(0));
        (void)tracker.track(view.picture.view(), frame(1));
        const auto observation = tracker.track(view.picture.view(), frame(2));
        if (!observation->predicted) continue;
        std::vector<TagDetection> found;
        ms += best([&] {
          found = *detector.detect_in(view.picture.view(), {observation->region, decimate, observation->min_contrast});
        });
        tags += static_cast<double>(found.size());
        BodyPoseOptions options;
        options.focal_sigma = options.face_turn_sigma_rad = options.face_shift_sigma_m = 0;
        const auto seen = observations_of(found);
        const auto pose = find_body_pose(rig, body, seen, std::nullopt, options);
        if (!pose) continue;
        errors.add(*pose, view.truth);
        if (work != CornerRefinement::edge_search || decimate != 2) continue;
        BodyPrediction before{pose->probe_body, true};
        before.probe_body.pose.translation += Vec3d{0.004, -0.003, 0.002};
        before.probe_body.pose.rotation =
            (Quat::about({0.6, 0, 0.8}, 0.03) * pose->probe_body.pose.rotation).normalized();
        for (std::size_t i = 0; i < 6; ++i) before.probe_body.covariance[i][i] += i < 3 ? 1e-3 : 1e-5;
        ++poses;
        with += best([&] { (void)find_body_pose(lenses, body, seen, before, options); });
        without += best([&] { (void)find_body_pose(lenses, body, seen, std::nullopt, options); });
      }
      const std::string figure = formatted("part.%g.%s", decimate, name);
      print(figure + ".ms", ms / static_cast<double>(views.size()), "ms");
      print(figure + ".detected", tags / static_cast<double>(views.size()), "");
      errors.print_as(figure);
    }
  }
  if (poses == 0) return;
  print("pose_only.predicted.ms", with / poses, "ms");
  print("pose_only.not_predicted.ms", without / poses, "ms");
}

}  // namespace

int main(int argc, char** argv) {
  bool quick = false;
  CLI::App app{"Time and accuracy of a body's pose.", "measure_marker_pose"};
  app.add_flag("--quick", quick, "Two attitudes, to test the program");
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  memcpy_gb_per_s = bench::memcpy_speed(1280 * 960).gigabytes_per_s;
  const RigParameters rig = test::camera_rig();
  const MarkerBody body = test::dodecahedron();
  const test::BodyCamera camera(rig, body);
  const auto views_at = [&](double width_px) {
    std::vector<PosedPicture> out;
    for (std::uint64_t i = 0; i < (quick ? 2u : 12u); ++i) {
      const Pose truth = test::body_at({0.01 * static_cast<double>(i % 5), 0, -test::distance_for(width_px)}, 100 + i);
      out.push_back({truth, camera.take(truth, 200 + i)});
    }
    return out;
  };
  for (const double width_px : quick ? std::vector<double>{400} : std::vector<double>{100, 200, 400, 700, 900}) {
    const std::vector<PosedPicture> views = views_at(width_px);
    measure_tracker(rig, body, views, std::to_string(static_cast<int>(width_px)) + "px");
    if (width_px == 400) measure_parts(rig, body, views);
  }
  const auto nothing = camera.take(test::body_at({0, 0, 1}, 1));
  BodyTracker tracker = std::move(*BodyTracker::make(body, rig, options_of(CornerRefinement::edge_search)));
  int n = 0;
  print("search.no_body.ms", best([&] { (void)tracker.track(nothing.view(), frame(n++)); }), "ms");
  return 0;
}
