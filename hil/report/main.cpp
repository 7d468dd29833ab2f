// demo_report: compares a recording of descriptors with the true light of their simulated scene, and draws a picture.
#include <cstdio>
#include <iostream>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <lightwell/codec.hpp>
#include <lightwell/recording.hpp>

#include "camera/backends/sim/sim_backend.hpp"
#include "report/error_evaluator.hpp"
#include "report/picture.hpp"

namespace {

using namespace lightwell;

enum Exit : int { kOk = 0, kBoundFailed = 1, kUsage = 2, kBadInput = 3 };

int fail(const Status& s) {
  std::cerr << "demo_report: " << s.message() << "\n";
  return kBadInput;
}

void print_json(const hil::Summary& s) {
  const nlohmann::ordered_json out = {{"frames", s.frames},
                                      {"held", s.held},
                                      {"flagged", s.flagged},
                                      {"median_error", s.median_error},
                                      {"largest_error", s.largest_error},
                                      {"median_bound_over_error", s.median_bound_over_error}};
  std::cout << out << std::endl;
}

void print_text(const hil::Summary& s) {
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

  hil::ErrorEvaluator evaluator(sim.scene());
  std::vector<hil::Evaluation> evaluations;
  Record record;
  // The last descriptor is drawn; if environment maps were sent, the last one with a complete map.
  Descriptor drawn;
  std::size_t drawn_bytes = 0;
  hil::Evaluation drawn_evaluation;
  while (reader->next(record)) {
    Result<Descriptor> d = decode_descriptor(record.payload);
    if (!d) return fail(d.status());
    evaluations.push_back(evaluator.evaluate(*d, state_of(sim, info->exposure_s.size(), d->sequence)));
    if (drawn.environment && !(d->environment && d->environment->whole())) continue;
    drawn = std::move(*d);
    if (drawn.environment && !drawn.environment->whole()) drawn.environment.reset();
    drawn_bytes = record.payload.size();
    drawn_evaluation = evaluations.back();
  }
  const hil::Summary summary = hil::summarize(evaluations);
  json ? print_json(summary) : print_text(summary);
  if (!picture.empty() && !evaluations.empty()) {
    const sim::SceneState state = state_of(sim, info->exposure_s.size(), drawn.sequence);
    const Status s = hil::draw_report(picture, title.empty() ? uri->path : title, sim.scene(), state,
                                      *info->calibration, Lighting::of(drawn), drawn_bytes, drawn_evaluation);
    if (!s.ok()) return fail(s);
  }
  return summary.good() ? kOk : kBoundFailed;
}
