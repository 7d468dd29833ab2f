#include "tools/lightwell_calibrate/geometry_command.hpp"

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <numbers>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include <CLI/CLI.hpp>

#include "calibration/model/lens_pair.hpp"
#include "calibration/model/projection.hpp"
#include "calibration/solve/geometry/coverage.hpp"
#include "calibration/solve/geometry/geometry.hpp"
#include "pose/rectified_view.hpp"
#include "pose/tag_detector.hpp"
#include "tools/lightwell_calibrate/arguments.hpp"
#include "tools/lightwell_calibrate/board_pictures.hpp"
#include "tools/lightwell_calibrate/geometry_report.hpp"
#include "tools/lightwell_calibrate/json.hpp"
#include "tools/lightwell_calibrate/output.hpp"

namespace lightwell::calibrate {
namespace {

using namespace calibration;
using std::numbers::pi;

/// Exit status of coverage: the pictures are valid, but some views are missing.
constexpr int kLacking = 3;
constexpr double kDegree = pi / 180;

constexpr const char* kGeometryFooter = R"(Examples:
  lightwell-calibrate board --output board.pdf --output board.yaml         print it and glue it to something flat
  lightwell-calibrate coverage --board board.yaml --lens0 pictures --watch   while taking pictures
  lightwell-calibrate geometry --board board.yaml --lens0 pictures --field-deg 190 --output rig.textproto
  lightwell-calibrate geometry --board north.yaml --board east.yaml --board south.yaml --board west.yaml \
      --lens0 front --lens1 back --field-deg 190 --output rig.textproto --report rig.png

Take 20 to 40 pictures, the board near the lens and tilted, all over the picture up to its edge. Two lenses: boards all
around; pictures of the same name in both folders were taken at the same time. Several boards need different tag
numbers.
The photometry of the rig of --calibration, if any, is kept. Without it pictures are read as sRGB, and the output states
that (response { kind: SRGB }).
Models: kannala-brandt fits fisheyes and webcams; mei fits both, too, and includes Brown's radial and tangential
distortion; double-sphere is for fisheyes: the pictures of a webcam do not determine its parameters, which is an error.
A bent board, or one whose spacing differs from its file, is reported, and its shape is fitted and used. Pictures
without a board, of another board, or with many outliers are named.
Exit status: 0 done, 1 an input is wrong or insufficient (standard error has the remedy), 2 wrong usage.)";

constexpr const char* kCoverageFooter = R"(Example:
  lightwell-calibrate coverage --board board.yaml --lens0 pictures --field-circle-px 470 --picture coverage.png --watch

Exit status: 0 no view is missing, 1 an input is wrong, 2 wrong usage, 3 some views are missing.)";

struct Inputs {
  BoardPictures pictures;
  std::vector<std::string> lens0, lens1;
  bool json = false;
};

void add_inputs(CLI::App& app, Inputs& in) {
  app.add_option("--board", in.pictures.boards, "Kalibr's YAML of a board; repeat it for several boards")->required();
  app.add_option("--lens0", in.lens0, "Pictures of lens 0, or a folder of them")->required();
  app.add_option("--lens1", in.lens1, "Pictures of lens 1, or a folder of them");
  app.add_flag("--json", in.json, "Print the result as JSON on standard output");
}

/// CLI11 expects the arguments in reverse order.
int parse(CLI::App& app, std::span<char* const> arguments, bool& done) {
  std::vector<std::string> words(arguments.rbegin(), arguments.rend());
  done = true;
  try {
    app.parse(words);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kDone : kUsage;
  }
  done = false;
  return kDone;
}

Progress print_progress(const char* what) {
  const bool terminal = isatty(STDERR_FILENO) == 1;
  return [what, terminal](std::size_t done, std::size_t of) {
    if (terminal)
      std::fprintf(stderr, "\r\033[K%s: %zu of %zu pictures%s", what, done, of, done == of ? "\n" : "");
    else if (done == of || done % 10 == 0)
      std::fprintf(stderr, "%s: %zu of %zu pictures\n", what, done, of);
  };
}

int fail(const char* command, const Status& s) {
  std::cerr << "lightwell-calibrate " << command << ": " << s.message() << "\n";
  return kBadInput;
}

LensParameters guess(const LensSize& size, const ModelParameters& model, double max_angle_rad) {
  LensParameters lens;
  lens.width = size.width;
  lens.height = size.height;
  lens.model = model;
  lens.max_angle_rad = max_angle_rad;
  lens.pose_cv.rotation = upright_lens_cv();
  return lens;
}

RigParameters rig_of(const GeometryFit& fit, const std::vector<LensSize>& sizes, double field_rad,
                     const RigParameters* before) {
  RigParameters rig;
  if (before != nullptr) rig.nits_per_unit = before->nits_per_unit;
  for (std::size_t k = 0; k < fit.lenses.size(); ++k) {
    const LensFit& lens = fit.lenses[k];
    // Without --field-deg the field of view is limited to the observed angles.
    const double half = field_rad > 0 ? field_rad / 2 : lens.max_observed_angle_rad;
    rig.lenses.push_back(guess(sizes[k], lens.model, std::min(half, lens.max_model_angle_rad)));
    // The response with which the pictures were read.
    rig.lenses[k].photometry.response.kind = ResponseCurve::Kind::srgb;
    if (before != nullptr && k < before->lenses.size()) rig.lenses[k].photometry = before->lenses[k].photometry;
  }
  if (fit.lenses.size() > 1) {
    const std::array<Pose, 2> poses = pair_in_probe(fit.pair);
    for (std::size_t k = 0; k < 2; ++k) rig.lenses[k].pose_cv = poses[k];
  }
  return rig;
}

/// Radius of the image circle, px; 0 if there is none.
double circle_of(const LensParameters& lens) {
  const double t = lens.max_angle_rad * (1 - 1e-9);
  const CameraModel camera(lens);
  const auto middle = camera.project({0, 0, 1}), rim = camera.project({std::sin(t), 0, std::cos(t)});
  return middle && rim ? std::hypot(rim->x - middle->x, rim->y - middle->y) : 0;
}

/// A JSON object of named numbers: {"fx": 286.1}.
std::string named(const std::vector<const char*>& names, const std::vector<double>& values) {
  std::string out;
  for (std::size_t i = 0; i < names.size(); ++i)
    out += (i > 0 ? ", " : "") + json_string(names[i]) + ": " + json_number(values[i]);
  return "{" + out + "}";
}

std::string json_of(const LensFit& lens) {
  const std::vector<double> numbers = parameters_of(lens.model);
  std::vector<double> sigmas;
  for (std::size_t i = 0; i < numbers.size(); ++i) sigmas.push_back(std::sqrt(lens.covariance[i * numbers.size() + i]));
  const std::vector<const char*> names = parameter_names(lens.model);
  return "{\"model\": " + named(names, numbers) + ", \"sigma\": " + named(names, sigmas) +
         ", \"seen_deg\": " + json_number(lens.max_observed_angle_rad / kDegree) +
         ", \"direction_3_sigma_deg\": " + json_number(lens.direction_uncertainty_rad / kDegree) + "}";
}

std::string json_of(const GeometryFit& fit, const BoardObservations& seen, const char* response) {
  std::string out = "{\"rms_px\": " + json_number(fit.bundle.rms_px) +
                    ", \"sigma_px\": " + json_number(fit.bundle.sigma_px) + ",\n \"lenses\": [";
  for (std::size_t k = 0; k < fit.lenses.size(); ++k) out += (k > 0 ? ",\n  " : "\n  ") + json_of(fit.lenses[k]);
  out += "]";
  if (fit.lenses.size() > 1) {
    const Quat& q = fit.pair.rotation;
    const Vec3d& t = fit.pair.translation;
    std::vector<double> sigmas;
    for (std::size_t i = 0; i < 6; ++i) sigmas.push_back(std::sqrt(fit.pair_covariance[7 * i]));
    out += ",\n \"lens1_lens0_cv\": {\"translation_m\": " + json_numbers(std::array{t.x, t.y, t.z}) +
           ", \"rotation_xyzw\": " + json_numbers(std::array{q.x, q.y, q.z, q.w}) +
           ", \"sigma_rotation_rad_translation_m\": " + json_numbers(sigmas) +
           "},\n \"time_offset_s\": " + json_number(fit.time_offset_s) +
           ", \"time_offset_sigma_s\": " + json_number(fit.time_offset_sigma_s);
  }
  out += ",\n \"response\": " + json_string(response) + ",\n \"boards\": [";
  for (std::size_t b = 0; b < fit.boards.size(); ++b) {
    const BoardFit& board = fit.boards[b];
    out += (b > 0 ? ", " : "") + std::string("{\"name\": ") + json_string(seen.boards[b].name) +
           ", \"spacing_change\": " + json_number(board.shape.spacing_change()) +
           ", \"spacing_change_sigma\": " + json_number(board.spacing_sigma) +
           ", \"flatness_mm\": " + json_number(1e3 * board.flatness_m) + "}";
  }
  out += "],\n \"pictures\": [";
  for (std::size_t i = 0; i < fit.pictures.size(); ++i)
    out += (i > 0 ? ",\n  " : "\n  ") + std::string("{\"name\": ") + json_string(seen.pictures[i].name) +
           ", \"points\": " + std::to_string(fit.pictures[i].points) +
           ", \"outliers\": " + std::to_string(fit.pictures[i].outliers) +
           ", \"other_board\": " + (fit.pictures[i].other_board ? "true" : "false") + "}";
  out += "],\n \"notes\": [";
  for (std::size_t i = 0; i < fit.notes.size(); ++i) out += (i > 0 ? ", " : "") + json_string(fit.notes[i]);
  return out + "]}\n";
}

/// Prints the fit for people. "+-" is one standard deviation.
void print_summary(const GeometryFit& fit) {
  std::printf("%.3f px RMS over %zu points; noise of a coordinate %.3f px\n", fit.bundle.rms_px,
              fit.bundle.residuals.size(), fit.bundle.sigma_px);
  for (std::size_t k = 0; k < fit.lenses.size(); ++k) {
    const LensFit& lens = fit.lenses[k];
    const std::vector<double> numbers = parameters_of(lens.model);
    std::printf(
        "lens %zu: fx %.3f +- %.3f, fy %.3f +- %.3f px; observed up to %.1f degrees from the axis; directions accurate "
        "to %.4f degrees (3 sigma)\n",
        k, numbers[0], std::sqrt(lens.covariance[0]), numbers[1], std::sqrt(lens.covariance[numbers.size() + 1]),
        lens.max_observed_angle_rad / kDegree, lens.direction_uncertainty_rad / kDegree);
  }
  if (fit.lenses.size() > 1) {
    // Row-major 6 x 6: variances of the rotation at 0, 7, 14 and of the translation at 21, 28, 35.
    const std::vector<double>& c = fit.pair_covariance;
    std::printf(
        "pair: %.3f mm apart, position +- %.3f mm, orientation +- %.4f degrees; lens 1 is %.3f +- %.3f ms late "
        "(0 without --time-offset)\n",
        1e3 * length(fit.pair.translation), 1e3 * std::sqrt(c[21] + c[28] + c[35]),
        std::sqrt(c[0] + c[7] + c[14]) / kDegree, 1e3 * fit.time_offset_s, 1e3 * fit.time_offset_sigma_s);
  }
}

}  // namespace

int geometry_command(std::span<char* const> arguments) {
  CLI::App app{"Calibrates lenses from pictures of boards of AprilTags.", "lightwell-calibrate geometry"};
  app.footer(kGeometryFooter);
  Inputs in;
  std::string output, report, calibration, model = "kannala-brandt";
  double field_deg = 0;
  bool offset = false;
  add_inputs(app, in);
  app.add_option("--output", output, "The rig in text format; replaced atomically")->required();
  app.add_option("--model", model,
                 "kannala-brandt, double-sphere or mei, which includes Brown's distortion [kannala-brandt]")
      ->check(CLI::IsMember({"kannala-brandt", "double-sphere", "mei"}));
  app.add_option("--field-deg", field_deg,
                 "Field of view of the lenses [limited to the angles at which boards were seen]")
      ->check(CLI::Range(1.0, 360.0));
  app.add_option("--calibration", calibration, "A rig whose photometry is kept and used to read the pictures [sRGB]");
  app.add_option("--report", report, "A picture of points and residuals, .png or .svg");
  app.add_option("--rate-hz", in.pictures.rate_hz, "Pictures per second of a moving rig; needed by --time-offset")
      ->check(CLI::PositiveNumber);
  app.add_flag("--time-offset", offset, "Estimate by how much lens 1 takes its pictures later");
  bool done = false;
  if (const int status = parse(app, arguments, done); done) return status;
  if (offset && (in.lens1.empty() || !(in.pictures.rate_hz > 0))) {
    std::cerr << "lightwell-calibrate geometry: --time-offset needs --lens1 and --rate-hz\n";
    return kUsage;
  }

  std::optional<RigParameters> before;
  if (!calibration.empty()) {
    Result<RigParameters> loaded = load_calibration(calibration);
    if (!loaded) return fail("geometry", loaded.status());
    before = std::move(*loaded);
    for (const LensParameters& lens : before->lenses) in.pictures.photometry.push_back(lens.photometry);
  }
  in.pictures.lenses = {in.lens0};
  if (!in.lens1.empty()) in.pictures.lenses.push_back(in.lens1);
  Result<BoardObservations> seen = read_board_observations(in.pictures, nullptr, print_progress("looking for tags"));
  if (!seen) return fail("geometry", seen.status());
  GeometryOptions options;
  options.time_offset = offset;
  Result<GeometryFit> fit = calibrate_geometry(*seen, options);
  if (!fit) return fail("geometry", fit.status());
  // With approximate lenses, tags near the edge can be searched in rectified views.
  FirstPass first_pass;
  const double half = field_deg > 0 ? 0.5 * field_deg * kDegree : pi;
  for (std::size_t k = 0; k < fit->lenses.size(); ++k) {
    const LensSize& size = seen->lenses[k];
    first_pass.lenses.push_back(guess(size, fit->lenses[k].model, std::min(half, fit->lenses[k].max_model_angle_rad)));
    first_pass.rectify.push_back(
        !views_of(CameraModel(first_pass.lenses[k]), size.width, size.height, TagDetectorOptions{}.rectify_beyond_rad)
             .empty());
  }
  first_pass.seen = std::move(*seen);
  seen = read_board_observations(in.pictures, &first_pass, print_progress("searching the edges"));
  if (!seen) return fail("geometry", seen.status());
  options.kind = model == "mei"             ? LensKind::mei
                 : model == "double-sphere" ? LensKind::double_sphere
                                            : LensKind::kannala_brandt;
  fit = calibrate_geometry(*seen, options);
  if (!fit) return fail("geometry", fit.status());

  for (const Picture& p : seen->pictures)
    if (p.observations.empty()) fit->notes.push_back(p.name + " shows no tag of a board");
  const RigParameters rig = rig_of(*fit, seen->lenses, field_deg * kDegree, before ? &*before : nullptr);
  if (const Status s = rig.validate(); !s.ok()) return fail("geometry", s);
  for (const std::string& note : fit->notes) std::cerr << "lightwell-calibrate geometry: " << note << "\n";
  for (std::size_t k = 0; k < rig.lenses.size(); ++k)
    if (fit->lenses[k].max_observed_angle_rad < 0.95 * rig.lenses[k].max_angle_rad)
      std::cerr << "lightwell-calibrate geometry: lens " << k << " saw boards up to "
                << fit->lenses[k].max_observed_angle_rad / kDegree << " degrees from its axis; beyond, up to "
                << rig.lenses[k].max_angle_rad / kDegree
                << ", the model extrapolates: show the board nearer to the edge\n";
  if (const Status s = write_output(output, calibration_to_text(rig)); !s.ok()) return fail("geometry", s);
  if (!report.empty()) {
    std::vector<Coverage> covered;
    for (std::size_t k = 0; k < rig.lenses.size(); ++k)
      covered.push_back(coverage(fit->used, static_cast<int>(k), circle_of(rig.lenses[k])));
    if (const Status s =
            draw_lenses(fit->used, covered, fit->bundle.residuals, "lightwell-calibrate geometry: " + output, report);
        !s.ok())
      return fail("geometry", s);
  }
  const char* response = before ? "that of --calibration" : "sRGB, because no --calibration was given";
  if (in.json)
    std::cout << json_of(*fit, *seen, response) << std::flush;
  else
    print_summary(*fit), std::printf("pictures were read with the response: %s\n", response);
  return kDone;
}

int coverage_command(std::span<char* const> arguments) {
  CLI::App app{"Reports which part of the picture still lacks views of a board.", "lightwell-calibrate coverage"};
  app.footer(kCoverageFooter);
  Inputs in;
  std::string picture;
  double circle_px = 0;
  bool watch = false;
  add_inputs(app, in);
  app.add_option("--field-circle-px", circle_px, "Radius of the image circle; no views are needed outside")
      ->check(CLI::PositiveNumber);
  app.add_option("--picture", picture, "Draw the coverage, .png or .svg; replaced each time");
  app.add_flag("--watch", watch, "Repeat every two seconds until no view is missing");
  bool done = false;
  if (const int status = parse(app, arguments, done); done) return status;
  in.pictures.lenses = {in.lens0};
  if (!in.lens1.empty()) in.pictures.lenses.push_back(in.lens1);
  for (;;) {
    const Result<BoardObservations> seen = read_board_observations(
        in.pictures, nullptr, watch ? Progress([](std::size_t, std::size_t) {}) : print_progress("looking for tags"));
    if (!seen && !(watch && seen.status().code() == StatusCode::not_found)) return fail("coverage", seen.status());
    bool lacking = !seen.ok();
    if (seen) {
      std::vector<Coverage> all;
      std::string json;
      for (int lens = 0; lens < static_cast<int>(seen->lenses.size()); ++lens) {
        all.push_back(coverage(*seen, lens, circle_px));
        const std::vector<std::string> next = suggest_views(all.back());
        lacking = lacking || !next.empty();
        if (in.json) {
          json += (lens > 0 ? ", " : "") + std::string("{\"lens\": ") + std::to_string(lens) +
                  ", \"share\": " + json_number(all.back().share()) +
                  ", \"pictures\": " + std::to_string(all.back().with_board) + ", \"advice\": [";
          for (std::size_t i = 0; i < next.size(); ++i) json += (i > 0 ? ", " : "") + json_string(next[i]);
          json += "]}";
          continue;
        }
        std::printf("lens %d: %d %% of the picture known from %d pictures\n", lens,
                    static_cast<int>(100 * all.back().share()), all.back().with_board);
        for (const std::string& words : next) std::printf("  %s\n", words.c_str());
      }
      if (in.json) std::printf("[%s]\n", json.c_str());
      std::fflush(stdout);
      if (!picture.empty())
        if (const Status s = draw_lenses(*seen, all, {}, "lightwell-calibrate coverage", picture); !s.ok())
          return fail("coverage", s);
    }
    if (!lacking) return kDone;
    if (!watch) return kLacking;
    std::this_thread::sleep_for(std::chrono::seconds(2));
  }
}

}  // namespace lightwell::calibrate
