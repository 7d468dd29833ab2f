// demo_report: compares a recording of descriptors with the true light of their simulated scene, and draws a picture.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <map>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <lightwell/codec.hpp>
#include <lightwell/quantile.hpp>
#include <lightwell/query.hpp>
#include <lightwell/recording.hpp>

#include "camera/backends/sim/sim_backend.hpp"
#include "reference/irradiance.hpp"
#include "report/picture.hpp"

namespace {

using namespace lightwell;

enum Exit : int { kOk = 0, kBoundFailed = 1, kUsage = 2, kBadInput = 3 };

/// Result for one descriptor.
struct Evaluation {
  double error = 0;      ///< The larger of the plain and the luminance-weighted relative RMS error of irradiance.
  double bound = 0;      ///< The descriptor's bound of that error.
  bool flagged = false;  ///< The descriptor states no finite bound.

  [[nodiscard]] bool held() const { return error <= bound; }
};

/// Computes the true irradiance once for each state of the lamps with the reference implementation (tests/reference).
class ErrorEvaluator {
 public:
  explicit ErrorEvaluator(const sim::Scene& scene) : scene_(scene), normals_(reference::fibonacci_normals(2048)) {}

  Evaluation evaluate(const Descriptor& descriptor, const sim::SceneState& state) {
    std::vector<reference::Rgb>& truth = truth_[state.lamp_factor];
    if (truth.empty()) {
      const sim::Panorama& p = scene_.panorama(state);
      const reference::Panorama world{p.width, p.height, {p.rgb.begin(), p.rgb.end()}};
      truth = reference::irradiance_at(world, normals_);
    }
    std::vector<reference::Rgb> answer;
    answer.reserve(normals_.size());
    const Quat to_probe = state.rotation_world_probe.inverse();
    for (const reference::V3& n : normals_) {
      const Irradiance e = irradiance_at(descriptor, vec_cast<float>(rotate(to_probe, Vec3d{n.x, n.y, n.z})));
      answer.push_back({e.r, e.g, e.b});
    }
    const reference::IrradianceError error = reference::irradiance_error(truth, answer);
    Evaluation v;
    v.error = std::max(error.rms, error.luminance_weighted);
    v.bound = descriptor.bound.total;
    v.flagged = !std::isfinite(v.bound);
    return v;
  }

 private:
  const sim::Scene& scene_;
  std::vector<reference::V3> normals_;  ///< World frame; they are rotated into the probe's frame for the descriptor.
  std::map<double, std::vector<reference::Rgb>> truth_;  ///< By lamp factor.
};

/// Statistics over a run.
struct Summary {
  std::size_t frames = 0, held = 0, flagged = 0;
  double median_error = 0, largest_error = 0, median_bound_over_error = 0;

  /// There were frames, the bound held in 99 % of them, and at most 10 % were flagged.
  [[nodiscard]] bool good() const { return frames > 0 && 100 * held >= 99 * frames && 10 * flagged <= frames; }
};

Summary summarize(const std::vector<Evaluation>& evaluations) {
  Summary s;
  s.frames = evaluations.size();
  std::vector<double> errors, ratios;
  for (const Evaluation& v : evaluations) {
    s.held += v.held() ? 1 : 0;
    s.flagged += v.flagged ? 1 : 0;
    errors.push_back(v.error);
    s.largest_error = std::max(s.largest_error, v.error);
    if (!v.flagged && v.error > 0) ratios.push_back(v.bound / v.error);
  }
  s.median_error = errors.empty() ? 0 : upper_quantile(errors, 0.5);
  s.median_bound_over_error = ratios.empty() ? 0 : upper_quantile(ratios, 0.5);
  return s;
}

int fail(const Status& s) {
  std::cerr << "demo_report: " << s.message() << "\n";
  return kBadInput;
}

void print_json(const Summary& s) {
  const nlohmann::ordered_json out = {{"frames", s.frames},
                                      {"held", s.held},
                                      {"flagged", s.flagged},
                                      {"median_error", s.median_error},
                                      {"largest_error", s.largest_error},
                                      {"median_bound_over_error", s.median_bound_over_error}};
  std::cout << out << std::endl;
}

void print_text(const Summary& s) {
  std::printf(
      "%zu descriptors against the truth: bound held in %.1f %%, flagged %.1f %%; error of irradiance median "
      "%.2f %%, largest %.2f %%; bound over error, median %.1f\n",
      s.frames, s.frames > 0 ? 100.0 * static_cast<double>(s.held) / static_cast<double>(s.frames) : 0,
      s.frames > 0 ? 100.0 * static_cast<double>(s.flagged) / static_cast<double>(s.frames) : 0, 100 * s.median_error,
      100 * s.largest_error, s.median_bound_over_error);
  if (s.frames == 0)
    std::printf("the recording has no descriptors\n");
  else if (!s.good())
    std::printf("not good: the bound must hold in 99 %%, and at most 10 %% may be flagged%s\n",
                s.flagged > 0 ? " (clipped light: give the sensor a bracket, --bracket)" : "");
}

/// The scene at the middle of a capture that consists of `exposures` frames, one per exposure.
sim::SceneState state_of(const SimBackend& sim, std::uint64_t exposures, std::uint64_t capture) {
  const double middle = static_cast<double>(exposures - 1) / 2;
  const auto whole = static_cast<std::uint64_t>(middle);
  const double rest_s = (middle - static_cast<double>(whole)) / sim.scene().motion().frame_rate;
  return sim.scene().state_at(sim.scene_index(capture * exposures + whole), rest_s);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Compares a recording of descriptors with the true light of their simulated scene, and draws a picture."};
  app.footer(
      "Exit status: 0 the bound held in 99 % of the descriptors and at most 10 % were flagged, 1 otherwise, "
      "2 wrong usage, 3 invalid input.");
  std::string recording, camera, picture, title;
  CameraConfig config;
  bool json = false;
  app.add_option("--recording", recording, "Recording of `lightwell record`")->required();
  app.add_option("--camera", config.uri, "Camera URI of lightwelld, sim:...")->required();
  app.add_option("--width", config.width, "Width of one lens's image");
  app.add_option("--height", config.height, "Height of one lens's image");
  app.add_option("--frame-rate", config.frame_rate, "Frame rate of lightwelld");
  app.add_option("--exposure-s", config.capture.exposure_s, "Exposure times of lightwelld")->allow_extra_args(false);
  app.add_option("--picture", picture, "PNG file to draw");
  app.add_option("--title", title, "Title of the picture");
  app.add_flag("--json", json, "Print one JSON object instead of text");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  }

  const Result<CameraUri> uri = parse_camera_uri(config.uri);
  if (!uri) return fail(uri.status());
  Result<std::unique_ptr<CameraBackend>> made = make_sim_backend(*uri, config);
  if (!made) return fail(made.status());
  auto& sim = static_cast<SimBackend&>(**made);
  const Result<CameraInfo> info = sim.open();
  if (!info) return fail(info.status());
  Result<RecordReader> reader = RecordReader::open(recording);
  if (!reader) return fail(reader.status());

  ErrorEvaluator evaluator(sim.scene());
  std::vector<Evaluation> evaluations;
  Record record;
  // The last descriptor is drawn; if environment maps were sent, the last one with a complete map.
  Descriptor drawn;
  std::size_t drawn_bytes = 0;
  double drawn_error = 0;
  while (reader->next(record)) {
    Result<Descriptor> d = decode_descriptor(record.payload);
    if (!d) return fail(d.status());
    evaluations.push_back(evaluator.evaluate(*d, state_of(sim, info->exposure_s.size(), d->sequence)));
    if (drawn.environment && !(d->environment && d->environment->whole())) continue;
    drawn = std::move(*d);
    if (drawn.environment && !drawn.environment->whole()) drawn.environment.reset();
    drawn_bytes = record.payload.size();
    drawn_error = evaluations.back().error;
  }
  const Summary summary = summarize(evaluations);
  json ? print_json(summary) : print_text(summary);
  if (!picture.empty() && !evaluations.empty()) {
    const sim::SceneState state = state_of(sim, info->exposure_s.size(), drawn.sequence);
    const Status s = hil::draw_report(picture, title.empty() ? uri->path : title, sim.scene(), state,
                                      *info->calibration, Lighting::of(drawn), drawn_bytes, drawn_error);
    if (!s.ok()) return fail(s);
  }
  return summary.good() ? kOk : kBoundFailed;
}
