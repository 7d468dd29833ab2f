#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <iostream>
#include <numbers>
#include <string>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "calibration/model/cameras.hpp"
#include "calibration/solve/geometry/geometry.hpp"
#include "pose/tag_detector.hpp"
#include "tools/command_line.hpp"
#include "tools/lightwell_calibrate/board_pictures.hpp"
#include "tools/lightwell_calibrate/commands.hpp"

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
      --lens0 front --lens1 back --field-deg 190 --output rig.textproto --json \
      | lightwell_plot.py --output rig.png                                 draws points and residuals

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

constexpr const char* kCoverageFooter = R"(Examples:
  lightwell-calibrate coverage --board board.yaml --lens0 pictures --field-circle-px 470 --watch
  lightwell-calibrate coverage --board board.yaml --lens0 pictures --watch --json | lightwell_plot.py --output seen.png

The second one draws the picture again after each look.
Exit status: 0 no view is missing, 1 an input is wrong, 2 wrong usage, 3 some views are missing.)";

void add_inputs(CLI::App& app, BoardPictures& in, bool& json) {
  app.add_option("--board", in.boards, "Kalibr's YAML of a board; repeat it for several boards")->required();
  app.add_option("--lens0", in.lenses[0], "Pictures of lens 0, or a folder of them")->required();
  app.add_option("--lens1", in.lenses[1], "Pictures of lens 1, or a folder of them");
  app.add_flag("--json", json, "Print the result as JSON on standard output; lightwell_plot.py draws it");
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

LensParameters guess(const LensSize& size, const ModelParameters& model, double max_angle_rad) {
  return {size.width, size.height, model, max_angle_rad, {upright_lens_cv(), {}}, {}};
}

CalibrationReport report_of(const GeometryFit& fit, const RigParameters* before) {
  CalibrationReport out;
  out.geometry_time_s = std::time(nullptr);
  out.rms_px = fit.bundle.rms_px;
  out.points = static_cast<std::uint32_t>(fit.bundle.residuals.size());
  for (const LensFit& lens : fit.lenses) {
    out.seen_deg.push_back(lens.max_observed_angle_rad / kDegree);
    out.direction_3_sigma_deg.push_back(lens.direction_uncertainty_rad / kDegree);
  }
  if (before != nullptr && before->report) out.photometry_time_s = before->report->photometry_time_s;
  return out;
}

RigParameters rig_of(const GeometryFit& fit, const std::vector<LensSize>& sizes, double field_rad,
                     const RigParameters* before) {
  RigParameters rig;
  if (before != nullptr) rig.nits_per_unit = before->nits_per_unit;
  rig.report = report_of(fit, before);
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
    const std::array<Pose, 2> poses = pair_in_probe(fit.bundle.state.lens_from_rig[1]);
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

/// An object of named numbers: {"fx":286.1}.
nlohmann::ordered_json named(const std::vector<const char*>& names, const std::vector<double>& values) {
  nlohmann::ordered_json out = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < names.size(); ++i) out[names[i]] = json_number(values[i]);
  return out;
}

nlohmann::ordered_json json_of(const LensFit& lens) {
  const std::vector<double> numbers = parameters_of(lens.model);
  std::vector<double> sigmas;
  for (std::size_t i = 0; i < numbers.size(); ++i) sigmas.push_back(std::sqrt(lens.covariance[i * numbers.size() + i]));
  const std::vector<const char*> names = parameter_names(lens.model);
  return {{"model", named(names, numbers)},
          {"sigma", named(names, sigmas)},
          {"seen_deg", json_number(lens.max_observed_angle_rad / kDegree)},
          {"direction_3_sigma_deg", json_number(lens.direction_uncertainty_rad / kDegree)}};
}

nlohmann::ordered_json json_of(const GeometryFit& fit, const BoardObservations& seen, const char* response) {
  nlohmann::ordered_json lenses = nlohmann::ordered_json::array(), boards = lenses, pictures = lenses;
  for (const LensFit& lens : fit.lenses) lenses.push_back(json_of(lens));
  nlohmann::ordered_json out = {{"rms_px", json_number(fit.bundle.rms_px)},
                                {"sigma_px", json_number(fit.bundle.sigma_px)},
                                {"lenses", std::move(lenses)}};
  if (fit.lenses.size() > 1) {
    std::vector<double> sigmas;
    for (std::size_t i = 0; i < 6; ++i) sigmas.push_back(std::sqrt(fit.bundle.pair_covariance[7 * i]));
    out["lens1_lens0_cv"] = json_pose(fit.bundle.state.lens_from_rig[1]);
    out["lens1_lens0_cv"]["sigma_rotation_rad_translation_m"] = json_numbers(sigmas);
    out["time_offset_s"] = json_number(fit.bundle.state.time_offset_s);
    out["time_offset_sigma_s"] = json_number(fit.bundle.time_offset_sigma_s);
  }
  for (std::size_t b = 0; b < fit.boards.size(); ++b) {
    const BoardFit& board = fit.boards[b];
    boards.push_back({{"name", seen.boards[b].name},
                      {"spacing_change", json_number(board.shape.spacing_change())},
                      {"spacing_change_sigma", json_number(board.spacing_sigma)},
                      {"flatness_mm", json_number(1e3 * board.flatness_m)}});
  }
  for (std::size_t i = 0; i < fit.pictures.size(); ++i)
    pictures.push_back({{"name", seen.pictures[i].name},
                        {"points", fit.pictures[i].points},
                        {"outliers", fit.pictures[i].outliers},
                        {"other_board", fit.pictures[i].other_board}});
  out["response"] = response;
  out["boards"] = std::move(boards);
  out["pictures"] = std::move(pictures);
  out["notes"] = fit.notes;
  return out;
}

/// Pixels, rounded to thousandths, which suffices for a drawing.
double rounded(double px) { return std::round(1e3 * px) / 1e3; }

/// The points of a lens: x and y, px.
nlohmann::ordered_json points_of(const BoardObservations& seen, int lens) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const Picture& p : seen.pictures)
    if (p.lens == lens)
      for (const PointObservation& o : p.observations)
        out.push_back(std::array{rounded(o.pixel.x), rounded(o.pixel.y)});
  return out;
}

/// The points of a lens that were fitted: x and y, and the residuals of both, px.
nlohmann::ordered_json points_of(const GeometryFit& fit, int lens) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const Residual& r : fit.bundle.residuals) {
    const Picture& p = fit.used.pictures[static_cast<std::size_t>(r.picture)];
    if (p.lens != lens) continue;
    const PixelPosition& at = p.observations[static_cast<std::size_t>(r.observation)].pixel;
    out.push_back(std::array{rounded(at.x), rounded(at.y), rounded(r.x_px), rounded(r.y_px)});
  }
  return out;
}

nlohmann::ordered_json json_of(const Coverage& c, const LensSize& size, int lens, nlohmann::ordered_json points) {
  nlohmann::ordered_json lacking = nlohmann::ordered_json::array();
  for (int row = 0; row < c.rows; ++row)
    for (int column = 0; column < c.columns; ++column)
      if (c.needs_views(column, row)) lacking.push_back(std::array{column, row});
  return {{"lens", lens},        {"share", json_number(c.share())}, {"pictures", c.with_board},
          {"width", size.width}, {"height", size.height},           {"columns", c.columns},
          {"rows", c.rows},      {"lacking", std::move(lacking)},   {"points", std::move(points)}};
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
    const std::vector<double>& c = fit.bundle.pair_covariance;
    std::printf(
        "pair: %.3f mm apart, position +- %.3f mm, orientation +- %.4f degrees; lens 1 is %.3f +- %.3f ms late "
        "(0 without --time-offset)\n",
        1e3 * length(fit.bundle.state.lens_from_rig[1].translation), 1e3 * std::sqrt(c[21] + c[28] + c[35]),
        std::sqrt(c[0] + c[7] + c[14]) / kDegree, 1e3 * fit.bundle.state.time_offset_s,
        1e3 * fit.bundle.time_offset_sigma_s);
  }
}

}  // namespace

int geometry_command(const std::vector<std::string>& arguments) {
  CLI::App app{"Calibrates lenses from pictures of boards of AprilTags.", "lightwell-calibrate geometry"};
  app.footer(kGeometryFooter);
  BoardPictures in;
  std::string output, calibration, model = "kannala-brandt";
  double field_deg = 0;
  bool offset = false, json = false;
  add_inputs(app, in, json);
  app.add_option("--output", output, "The rig in text format; replaced atomically")->required();
  app.add_option("--model", model,
                 "kannala-brandt, double-sphere or mei, which includes Brown's distortion [kannala-brandt]")
      ->check(CLI::IsMember({"kannala-brandt", "double-sphere", "mei"}));
  app.add_option("--field-deg", field_deg,
                 "Field of view of the lenses [limited to the angles at which boards were seen]")
      ->check(CLI::Range(1.0, 360.0));
  app.add_option("--calibration", calibration, "A rig whose photometry is kept and used to read the pictures [sRGB]");
  app.add_option("--rate-hz", in.rate_hz, "Pictures per second of a moving rig; needed by --time-offset")
      ->check(CLI::PositiveNumber);
  app.add_flag("--time-offset", offset, "Estimate by how much lens 1 takes its pictures later");
  return run_command(app, arguments, [&] {
    if (offset && (in.lenses[1].empty() || !(in.rate_hz > 0)))
      throw UsageError("--time-offset needs --lens1 and --rate-hz");
    std::optional<RigParameters> before;
    if (!calibration.empty()) {
      before = require(load_calibration(calibration));
      for (const LensParameters& lens : before->lenses) in.photometry.push_back(lens.photometry);
    }
    // With approximate lenses, tags near the edge can be searched in rectified views.
    GeometryOptions options;
    options.time_offset = offset;
    FirstPass first_pass;
    first_pass.seen = read_board_observations(in, nullptr, print_progress("looking for tags"));
    const GeometryFit approximate = require(calibrate_geometry(first_pass.seen, options));
    const double half = field_deg > 0 ? 0.5 * field_deg * kDegree : pi;
    for (std::size_t k = 0; k < approximate.lenses.size(); ++k) {
      const LensSize& size = first_pass.seen.lenses[k];
      const LensFit& lens = approximate.lenses[k];
      first_pass.lenses.push_back(guess(size, lens.model, std::min(half, lens.max_model_angle_rad)));
      first_pass.rectify.push_back(
          !views_of(CameraModel(first_pass.lenses[k]), size.width, size.height, kRectifyBeyond_rad).empty());
    }
    const BoardObservations seen = read_board_observations(in, &first_pass, print_progress("searching the edges"));
    options.kind = model == "mei"             ? LensKind::mei
                   : model == "double-sphere" ? LensKind::double_sphere
                                              : LensKind::kannala_brandt;
    GeometryFit fit = require(calibrate_geometry(seen, options));

    for (const Picture& p : seen.pictures)
      if (p.observations.empty()) fit.notes.push_back(p.name + " shows no tag of a board");
    const RigParameters rig = rig_of(fit, seen.lenses, field_deg * kDegree, before ? &*before : nullptr);
    require(rig.validate());
    for (const std::string& note : fit.notes) std::cerr << app.get_name() << ": " << note << "\n";
    for (std::size_t k = 0; k < rig.lenses.size(); ++k)
      if (fit.lenses[k].max_observed_angle_rad < 0.95 * rig.lenses[k].max_angle_rad)
        std::cerr << app.get_name() << ": lens " << k << " saw boards up to "
                  << fit.lenses[k].max_observed_angle_rad / kDegree << " degrees from its axis; beyond, up to "
                  << rig.lenses[k].max_angle_rad / kDegree
                  << ", the model extrapolates: show the board nearer to the edge\n";
    require(write_output(output, calibration_to_text(rig)));
    const char* response = before ? "that of --calibration" : "sRGB, because no --calibration was given";
    if (json) {
      nlohmann::ordered_json document = json_of(fit, seen, response);
      for (std::size_t k = 0; k < rig.lenses.size(); ++k) {
        const int lens = static_cast<int>(k);
        document["coverage"].push_back(json_of(coverage(fit.used, lens, circle_of(rig.lenses[k])), fit.used.lenses[k],
                                               lens, points_of(fit, lens)));
      }
      std::cout << json_text(document) << std::endl;
    } else {
      print_summary(fit);
      std::printf("pictures were read with the response: %s\n", response);
    }
    return kDone;
  });
}

int coverage_command(const std::vector<std::string>& arguments) {
  CLI::App app{"Reports which part of the picture still lacks views of a board.", "lightwell-calibrate coverage"};
  app.footer(kCoverageFooter);
  BoardPictures in;
  double circle_px = 0;
  bool watch = false, json = false;
  add_inputs(app, in, json);
  app.add_option("--field-circle-px", circle_px, "Radius of the image circle; no views are needed outside")
      ->check(CLI::PositiveNumber);
  app.add_flag("--watch", watch, "Repeat every two seconds until no view is missing");
  return run_command(app, arguments, [&] {
    for (;; std::this_thread::sleep_for(std::chrono::seconds(2))) {
      BoardObservations seen;
      try {
        seen = read_board_observations(
            in, nullptr, watch ? Progress([](std::size_t, std::size_t) {}) : print_progress("looking for tags"));
      } catch (const InputError& error) {
        if (watch && error.code == StatusCode::not_found) continue;
        throw;
      }
      bool lacking = false;
      nlohmann::ordered_json document = nlohmann::ordered_json::array();
      for (int lens = 0; lens < static_cast<int>(seen.lenses.size()); ++lens) {
        const Coverage covered = coverage(seen, lens, circle_px);
        const std::vector<std::string> next = suggest_views(covered);
        lacking = lacking || !next.empty();
        if (json) {
          document.push_back(
              json_of(covered, seen.lenses[static_cast<std::size_t>(lens)], lens, points_of(seen, lens)));
          document.back()["advice"] = next;
          continue;
        }
        std::printf("lens %d: %d %% of the picture known from %d pictures\n", lens,
                    static_cast<int>(100 * covered.share()), covered.with_board);
        for (const std::string& words : next) std::printf("  %s\n", words.c_str());
      }
      if (json) std::printf("%s\n", json_text(document).c_str());
      std::fflush(stdout);
      if (!lacking) return int{kDone};
      if (!watch) return kLacking;
    }
  });
}

}  // namespace lightwell::calibrate
