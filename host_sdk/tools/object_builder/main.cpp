// lightwell-object: makes image-based objects from photographs.
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <lightwell/files.hpp>
#include <lightwell/image_object_encoder.hpp>

#include "capture.hpp"
#include "describe.hpp"

namespace {

using namespace lightwell;

constexpr const char* kAbout = R"(Makes an image-based object (lightwell/image_object.hpp) from a folder of photographs.

FOLDER/object.json describes the capture; `describe` writes it from a marker in the photographs:
  turns_deg             turn of the turntable of each view, right-handed about +Y (up)
  light_positions_m     [x, y, z] of the light, from the middle of the turntable; the camera is at +Z
  camera_distance_m     from the middle of the turntable to the camera
  half_width_m          half of what a picture's width shows at that distance
  reference_irradiance  of the light, in the unit in which lights are given later [1]
  pictures              name of the pictures, with {view} and {light}, both from 0: "{view}/{light}.png"
  coverage              of the masks, with {view}: white where the object is
  ambient               of pictures in even light, with {view}; may be absent
Pictures are PNG or JPEG of 8 or 16 bits in sRGB, all of one size, with the same exposure for all lights.)";

constexpr const char* kDescribeHelp =
    R"(The camera stands on a tripod, level with the object; a marker (lightwell-calibrate marker-sheet) stands
on the turntable beside it. Place the lamp, photograph all turns, place it elsewhere, photograph all turns
again. Neither the turns nor the places of the lamp need to be known. First, for each picture:
  lightwell-estimate --calibration PHONE.textproto --body DODECAHEDRON.textproto 0/0.jpg --json 0/0.json
then:
  lightwell-object describe FOLDER --pictures {view}/{light}.jpg --estimates {view}/{light}.json \
      --coverage {view}/mask.png --focal-px 3050
--focal-px is the focal length in pixels, that of the calibration. Keys with --json: views, lights, photographs,
without_marker, camera_distance_m, tilt_deg (of the camera), axis_error_deg (largest turn of the marker about
another axis), light_spread_deg (largest angle between a light in a view and its place),
brightest_by_darkest (ratio of the lights' irradiances).
Exit codes: 4 a file is wrong or exists, or the capture does not fit together; the message says how.)";

constexpr std::size_t kShown = 5;
/// The pictures are taken as those of a level camera and of one lamp: beyond these, a warning is printed.
constexpr double kLevelDeg = 5, kEvenRatio = 1.2;

int fail(const Status& status) {
  std::fprintf(stderr, "lightwell-object: %s\n", status.message().c_str());
  return 4;
}

/// Encoded views are kept beside the output until it is complete, so that an interrupted run goes on where it was.
int build(const std::string& folder, const std::string& output, const ObjectEncoderOptions& options) {
  if (const Status valid = options.validate(); !valid.ok()) return fail(valid);
  auto capture = tool::read_capture(folder);
  if (!capture.ok()) return fail(capture.status());
  if (const auto missing = tool::missing_pictures(*capture); !missing.empty()) {
    std::fprintf(stderr, "lightwell-object: %zu pictures are missing:\n", missing.size());
    for (std::size_t i = 0; i < missing.size() && i < kShown; ++i) std::fprintf(stderr, "  %s\n", missing[i].c_str());
    if (missing.size() > kShown) std::fprintf(stderr, "  and %zu more\n", missing.size() - kShown);
    return 1;
  }
  if (const Status size = tool::find_size(*capture); !size.ok()) return fail(size);
  const std::string parts = output + ".parts";
  std::error_code error;
  std::filesystem::create_directories(path_of(parts), error);
  std::vector<std::string> views;
  for (std::size_t v = 0; v < capture->views.size(); ++v) {
    const auto name = tool::fingerprint(*capture, v, options);
    if (!name.ok()) return fail(name.status());
    const std::string part = parts + "/" + std::to_string(v) + "_" + *name;
    auto view = read_text_file(part);
    const bool resumed = view.ok();
    if (!resumed) {
      view = tool::build_view(*capture, v, options);
      if (!view.ok()) return fail(view.status());
      if (const Status kept = write_atomically(part, *view, FileMode::umask); !kept.ok()) return fail(kept);
    }
    std::fprintf(stderr, "view %zu of %zu: %zu bytes%s\n", v + 1, capture->views.size(), view->size(),
                 resumed ? ", from the run before" : "");
    views.push_back(std::move(*view));
  }
  const auto file = make_image_object(capture->rig, views);
  if (!file.ok()) return fail(file.status());
  if (const Status written = write_atomically(output, *file, FileMode::umask); !written.ok()) return fail(written);
  std::filesystem::remove_all(path_of(parts), error);
  std::fprintf(stderr, "%s: %zu views, %zu lights, %zu bytes\n", output.c_str(), views.size(),
               capture->rig.light_positions.size(), file->size());
  return 0;
}

enum class Output { text, json };

int describe(const std::string& folder, const tool::CaptureNames& names, double focal_px, Output output) {
  const auto made = tool::describe_capture(folder, names, focal_px);
  if (!made.ok()) return fail(made.status());
  constexpr double kDegrees = 180 / std::numbers::pi;
  const tool::MarkerRig& m = made->marker;
  const double tilt_deg = m.tilt_rad * kDegrees;
  if (output == Output::json) {
    const nlohmann::ordered_json line{{"views", made->views},
                                      {"lights", made->lights},
                                      {"photographs", made->photographs},
                                      {"without_marker", made->without_marker},
                                      {"camera_distance_m", m.rig.camera_distance_m},
                                      {"tilt_deg", tilt_deg},
                                      {"axis_error_deg", m.axis_error_rad * kDegrees},
                                      {"light_spread_deg", m.light_spread_rad * kDegrees},
                                      {"brightest_by_darkest", m.brightest_by_darkest}};
    std::printf("%s\n", line.dump().c_str());
  } else {
    std::printf("%zu views, %zu lights; the marker is in %zu of %zu photographs\n", made->views, made->lights,
                made->photographs - made->without_marker, made->photographs);
    std::printf("camera at %.3f m; the axis is exact to %.2f degrees, lights agree within %.1f degrees\n",
                static_cast<double>(m.rig.camera_distance_m), m.axis_error_rad * kDegrees,
                m.light_spread_rad * kDegrees);
  }
  if (tilt_deg > kLevelDeg)
    std::fprintf(stderr, "lightwell-object: the camera looks %.0f degrees up or down; views are shown as level\n",
                 tilt_deg);
  if (m.brightest_by_darkest > kEvenRatio)
    std::fprintf(stderr,
                 "lightwell-object: the brightest light is %.1f times the darkest; pictures are taken as lit alike\n",
                 m.brightest_by_darkest);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{kAbout, "lightwell-object"};
  app.footer("Exit codes: 0 ok, 1 pictures are missing, 2 usage, 4 a file is wrong or cannot be written.");
  app.require_subcommand(1);
  std::string folder, output;
  lightwell::ObjectEncoderOptions options;
  CLI::App* const make = app.add_subcommand("build", "Makes the data set; goes on where an interrupted run stopped");
  make->add_option("FOLDER", folder, "Folder with object.json and the pictures")->required();
  make->add_option("--output", output, "The data set; encoded views are kept in OUTPUT.parts meanwhile")->required();
  make->add_option("--luminance-step", options.luminance_step, "Larger: smaller and worse, 0.0005 to 1")
      ->capture_default_str();
  make->add_option("--highlight-step", options.highlight_step, "The same of highlights; 0: none")
      ->capture_default_str();
  make->add_option("--base-step", options.base_step, "The same of the base colour")->capture_default_str();
  lightwell::tool::CaptureNames names;
  double focal_px = 0;
  bool json = false;
  CLI::App* const from_marker =
      app.add_subcommand("describe", "Writes object.json from a marker in the photographs")->footer(kDescribeHelp);
  from_marker->add_option("FOLDER", folder, "Folder of the pictures and estimates")->required();
  from_marker->add_option("--pictures", names.pictures, "Their names, with {view} and {light}")->required();
  from_marker->add_option("--estimates", names.estimates, "Those of lightwell-estimate's JSON")->required();
  from_marker->add_option("--coverage", names.coverage, "Those of the masks, with {view}")->required();
  from_marker->add_option("--ambient", names.ambient, "Those of pictures in even light, with {view}");
  from_marker->add_option("--focal-px", focal_px, "Focal length in pixels")->required()->check(CLI::PositiveNumber);
  from_marker->add_flag("--json", json, "What was found as a line of JSON");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return *make ? build(folder, output, options) : describe(folder, names, focal_px, json ? Output::json : Output::text);
}
