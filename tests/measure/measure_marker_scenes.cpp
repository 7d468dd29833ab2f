// Results of the shipped marker estimator for path-traced pictures of random scenes
// (tests/reference/mitsuba/marker_scenes), each estimated on its own as lightwell-estimate --body does. Prints one JSON
// object per line. For every picture:
//   picture, body, table, size_px, class, defect
//   answered, unsure, light          whether there is a descriptor; its flag; whether it has a light
//   error_deg, sigma_deg, mahalanobis2, primary_error_deg, irradiance_rms   SceneScore
//   shadow, found, tags              whether the shadow was used; numbers of lights and of tags
//   followed_error_deg               in the last frame of a sequence: the error of an estimator that got all its frames
// Then figures of each set (figure, value, pictures): SET.
//   answered, confident_wrong, confident_worst_deg, within_6.18   percent, percent, degrees, percent
//   CLASS.not_flagged, CLASS.median_deg, CLASS.decile_deg         direction errors of pictures that are not flagged
//   irradiance.flagged.median, .decile, irradiance.unflagged.median, .decile    percent
//   DEFECT.flagged, DEFECT.worst_deg, DEFECT.worst_of_all_deg     of the set defects
//   single_deg, followed_deg, ratio                               of the set moving: medians over the sequences
// Frames of a sequence report their exposure, as a camera does.
// Definitions and limits: README.md of the scenes and tests/figure_topics. The set `unseen` is measured only if it is
// named: nothing may be tuned on it.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/quantile.hpp>

#include "app/tag_body_finder.hpp"
#include "estimate/marker/marker_estimator.hpp"
#include "measure/marker_scenes.hpp"
#include "measure/output.hpp"
#include "tools/command_line.hpp"
#include "tools/lens_image.hpp"

namespace {

using namespace lightwell;
using measure::MarkerScene;
using measure::SceneClass;
using measure::SceneScore;

/// Chi-square quantiles of two degrees of freedom: 99.73 % (three sigma in one dimension), 95.45 % (two sigma).
constexpr double kThreeSigma2 = 11.83, kTwoSigma2 = 6.18;
constexpr double kWrongDeg = 10;
constexpr int kSequenceFrames = 10;
/// Between the frames of a sequence: 0.1 s.
constexpr std::int64_t kFrameStep_ns = 100'000'000;

struct Scored {
  const MarkerScene* scene = nullptr;
  SceneScore score;
};

struct Estimate {
  std::optional<Descriptor> descriptor;
  MarkerReport report;
};

std::unique_ptr<MarkerEstimator> estimator_for(const MarkerScene& scene, const MarkerBody& body) {
  return require(make_marker_estimator(scene.rig, body, require(make_tag_body_finder(scene.rig, body)), {}));
}

Estimate estimate(MarkerEstimator& estimator, const MarkerScene& scene, const std::string& folder) {
  const Image image = require(read_lens_image(folder + "/" + scene.name + ".jpg", scene.rig, 0));
  std::vector<Frame> frames(1);
  FrameInfo& info = frames.front().info;
  info.sequence = static_cast<std::uint64_t>(scene.frame) + 1;
  info.exposure_s = scene.exposure_s;
  info.mid_exposure = ProbeTime{(scene.frame + 1) * kFrameStep_ns};
  frames.front().add_view(view_of(image, 0));
  Estimate out;
  Descriptor descriptor;
  const Status s = estimator.estimate(frames, descriptor);
  if (!s.ok() && s.code() != StatusCode::not_found) require(s);
  if (s.ok()) out.descriptor = std::move(descriptor);
  out.report = estimator.report();
  return out;
}

void print(const MarkerScene& scene, const SceneScore& score, const MarkerReport& report,
           std::optional<double> followed_error_deg) {
  nlohmann::ordered_json line = {{"picture", scene.name},
                                 {"body", scene.body},
                                 {"table", scene.table},
                                 {"size_px", scene.size_px},
                                 {"class", to_string(scene.scene_class)},
                                 {"defect", scene.defect},
                                 {"answered", score.answered},
                                 {"unsure", score.unsure},
                                 {"light", score.light}};
  if (score.light) {
    line["error_deg"] = score.error_deg;
    line["sigma_deg"] = score.sigma_deg;
    line["mahalanobis2"] = score.mahalanobis2;
    line["primary_error_deg"] = score.primary_error_deg;
  }
  if (score.answered) {
    line["irradiance_rms"] = score.irradiance_rms;
    line["shadow"] = report.light.surround_model == marker::SurroundModel::ground_plane_with_shadow;
    line["found"] = report.light.lights.size();
    line["tags"] = report.body.tags;
    line["ambiguous"] = report.body.ambiguous;
    if (report.body.blur_px) line["blur_px"] = *report.body.blur_px;
    const Quat turn = inverse(scene.probe_body).rotation * report.body.probe_body.pose.rotation;
    line["pose_error_deg"] =
        2 * std::atan2(std::hypot(turn.x, turn.y, turn.z), std::abs(turn.w)) * 180 / std::numbers::pi;
    line["covered"] = report.counts.nonuniform + report.counts.occluded + report.light.outliers;
    line["patches"] = report.counts.patches;
    line["chi_square"] = report.light.chi_square;
    line["light_uncertain"] = report.light.uncertain;
    line["surround"] = static_cast<int>(report.light.surround_model);
    line["texture"] = report.light.ground_texture ? report.light.ground_texture->sigma : 0;
  }
  if (followed_error_deg) line["followed_error_deg"] = *followed_error_deg;
  measure::print_line(line);
}

/// Values of the pictures for which `of` holds.
std::vector<double> values(const std::vector<Scored>& all, const std::function<bool(const Scored&)>& of,
                           double SceneScore::*member) {
  std::vector<double> out;
  for (const Scored& one : all)
    if (of(one)) out.push_back(one.score.*member);
  return out;
}

/// Percent of the pictures with `of` for which `holds` is true too.
void print_percent(const std::string& figure, const std::vector<Scored>& all,
                   const std::function<bool(const Scored&)>& of, const std::function<bool(const Scored&)>& holds) {
  const auto count = std::ranges::count_if(all, of);
  const auto both = std::ranges::count_if(all, [&](const Scored& one) { return of(one) && holds(one); });
  measure::print_figure(figure, count > 0 ? 100.0 * static_cast<double>(both) / static_cast<double>(count) : NAN,
                        {{"pictures", static_cast<double>(count)}});
}

void print_quantiles(const std::string& figure, const std::string& unit, std::vector<double> of, double scale) {
  const auto count = static_cast<double>(of.size());
  measure::print_figure(figure + ".median" + unit, scale * median(of), {{"pictures", count}});
  measure::print_figure(figure + ".decile" + unit, scale * lower_quantile(of, 0.9), {{"pictures", count}});
}

void print_summary(const std::string& set, const std::vector<Scored>& all) {
  const auto any = [](const Scored&) { return true; };
  const auto answered = [](const Scored& one) { return one.score.answered; };
  const auto light = [](const Scored& one) { return one.score.light; };
  const auto sure = [](const Scored& one) { return one.score.light && !one.score.unsure; };
  print_percent(set + ".answered", all, any, answered);
  print_percent(set + ".confident_wrong", all, any, [&](const Scored& one) {
    return sure(one) && (one.score.error_deg > kWrongDeg || one.score.mahalanobis2 > kThreeSigma2);
  });
  const std::vector<double> errors = values(all, sure, &SceneScore::error_deg);
  measure::print_figure(set + ".confident_worst_deg", errors.empty() ? NAN : *std::ranges::max_element(errors),
                        {{"pictures", static_cast<double>(errors.size())}});
  print_percent(set + ".within_6.18", all, light,
                [](const Scored& one) { return one.score.mahalanobis2 <= kTwoSigma2; });
  for (const bool unsure : {false, true}) {
    const auto flagged = [&](const Scored& one) { return one.score.light && one.score.unsure == unsure; };
    const std::string name = unsure ? ".flagged" : ".unflagged";
    print_percent(set + ".within_6.18" + name, all, flagged,
                  [](const Scored& one) { return one.score.mahalanobis2 <= kTwoSigma2; });
    const auto same = [&](const Scored& one) { return one.score.answered && one.score.unsure == unsure; };
    print_quantiles(set + ".irradiance" + name, "", values(all, same, &SceneScore::irradiance_rms), 100);
  }
  for (const SceneClass c : {SceneClass::lit_faces, SceneClass::shadow_behind, SceneClass::other}) {
    const auto member = [&](const Scored& one) { return one.scene->scene_class == c; };
    const std::string figure = set + "." + to_string(c);
    print_percent(figure + ".not_flagged", all, member, sure);
    print_quantiles(figure, "_deg",
                    values(
                        all, [&](const Scored& one) { return member(one) && sure(one); }, &SceneScore::error_deg),
                    1);
  }
}

void print_defects(const std::vector<Scored>& all) {
  std::map<std::string, std::vector<Scored>> by_defect;
  for (const Scored& one : all) by_defect[one.scene->defect].push_back(one);
  for (const auto& [defect, of] : by_defect) {
    const auto worst = [&of = of](const std::function<bool(const Scored&)>& which) {
      const std::vector<double> e = values(of, which, &SceneScore::error_deg);
      return e.empty() ? NAN : *std::ranges::max_element(e);
    };
    const std::string figure = "defects." + defect;
    print_percent(
        figure + ".flagged", of, [](const Scored&) { return true; },
        [](const Scored& one) { return one.score.unsure; });
    const auto pictures = static_cast<double>(of.size());
    measure::print_figure(figure + ".worst_deg",
                          worst([](const Scored& o) { return o.score.light && !o.score.unsure; }),
                          {{"pictures", pictures}});
    measure::print_figure(figure + ".worst_of_all_deg", worst([](const Scored& o) { return o.score.light; }),
                          {{"pictures", pictures}});
  }
}

/// Pairs: the median error of a sequence's frames each on its own, and the error after all frames.
void print_moving(const std::vector<std::pair<double, double>>& sequences) {
  std::vector<double> single, followed;
  for (const auto& [alone, after] : sequences) single.push_back(alone), followed.push_back(after);
  const auto count = static_cast<double>(sequences.size());
  const double a = median(single), b = median(followed);
  measure::print_figure("moving.single_deg", a, {{"sequences", count}});
  measure::print_figure("moving.followed_deg", b, {{"sequences", count}});
  measure::print_figure("moving.ratio", b / a, {{"sequences", count}});
}

/// An estimator that gets the frames of a sequence one after the other. They have the same rig.
class Follower {
 public:
  /// The error after the last frame of a sequence, otherwise nullopt.
  std::optional<double> process(const MarkerScene& scene, const MarkerBody& body, const std::string& folder,
                                const SceneScore& alone) {
    if (scene.frame == 0) {
      estimator_ = estimator_for(scene, body);
      alone_.clear();
    }
    if (alone.light) alone_.push_back(alone.error_deg);
    const SceneScore score = measure::score(scene, estimate(*estimator_, scene, folder).descriptor);
    if (scene.frame + 1 < kSequenceFrames || !score.light) return std::nullopt;
    sequences_.emplace_back(median(alone_), score.error_deg);
    return score.error_deg;
  }
  [[nodiscard]] const std::vector<std::pair<double, double>>& sequences() const { return sequences_; }

 private:
  std::unique_ptr<MarkerEstimator> estimator_;
  std::vector<double> alone_;
  std::vector<std::pair<double, double>> sequences_;
};

void measure_set(const std::string& set, const std::string& folder, const std::string& bodies_folder) {
  const std::vector<MarkerScene> scenes = require(measure::load_marker_scenes(folder, set));
  std::map<std::string, MarkerBody> bodies;
  std::vector<Scored> all;
  Follower follower;
  for (const MarkerScene& scene : scenes) {
    if (!bodies.contains(scene.body))
      bodies.emplace(scene.body, require(load_marker_body(bodies_folder + "/" + scene.body + ".textproto")));
    const MarkerBody& body = bodies.at(scene.body);
    const Estimate one = estimate(*estimator_for(scene, body), scene, folder);
    all.push_back({&scene, measure::score(scene, one.descriptor)});
    const std::optional<double> followed_error_deg =
        set == "moving" ? follower.process(scene, body, folder, all.back().score) : std::nullopt;
    print(scene, all.back().score, one.report, followed_error_deg);
  }
  print_summary(set, all);
  if (set == "defects") print_defects(all);
  if (set == "moving") print_moving(follower.sequences());
}

}  // namespace

int main(int argc, char** argv) {
  std::string folder = LIGHTWELL_MARKER_SCENES, bodies_folder = LIGHTWELL_MARKER_BODIES;
  std::vector<std::string> sets = {"dev"};
  CLI::App app{"Results of the marker estimator for path-traced pictures of random scenes.", "measure_marker_scenes"};
  app.add_option("--set", sets, "dev, defects, moving, small, unseen; several may be given [dev]")
      ->check(CLI::IsMember({"dev", "defects", "moving", "small", "unseen"}));
  app.add_option("--scenes", folder, "Folder of SET.jsonl and SET/*.jpg [tests/reference/mitsuba/marker_scenes]");
  app.add_option("--bodies", bodies_folder, "Folder of the marker bodies [firmware/estimate/marker/bodies]");
  app.footer("Exit status: 0 measured, 1 failed, 2 wrong usage.");
  return run_command(app, {argv + 1, argv + argc}, [&] {
    for (const std::string& set : sets) measure_set(set, folder, bodies_folder);
    return kDone;
  });
}
