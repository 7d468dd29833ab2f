#include <algorithm>
#include <iostream>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "calibration/solve/import/import.hpp"
#include "tools/command_line.hpp"
#include "tools/lightwell_calibrate/commands.hpp"

namespace lightwell::calibrate {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

constexpr const char* kFooter = R"(Examples:
  lightwell-calibrate import camchain.yaml --output rig.textproto
  lightwell-calibrate import camchain.yaml --camera 1 --output lens.textproto
  lightwell-calibrate import out_camera_params.xml --kind opencv --max-angle-deg 97.5 --output rig.textproto --json

Reads
  opencv   cv::FileStorage, YAML or XML: fisheye (4 coefficients) and omnidir (xi). OpenCV's omnidir samples do not
           write the size: add image_width and image_height.
  kalibr   a camchain: pinhole-equidistant, ds-none, omni-none, omni-radtan. Two cameras become a pair whose -Z is the
           first one's axis, with the origin midway.
  ros      sensor_msgs/CameraInfo as YAML: equidistant (fisheye); binning and region of interest are applied.
Lenses with radtan or plumb_bob are accepted if they have no coefficients but k1 k2 p1 p2, and refused otherwise.

These files contain no response, vignetting and noise: the lens is written with a linear response; measure them.
Notes on assumptions go to standard error and, as comments, into the file.
Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.)";

struct Arguments {
  std::string input, output;
  ImportOptions options;
  bool json = false;
};

/// A comment of one line; replaces line breaks in names from the file.
std::string comment(const std::string& text) {
  std::string out = "# " + text;
  std::replace_if(
      out.begin() + 2, out.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  return out + "\n";
}

std::string file_text(const Arguments& arguments, const ImportedCalibration& imported) {
  std::string text = comment("Imported by lightwell-calibrate from " + arguments.input + " (" +
                             std::string(to_string(imported.kind)) + ": " + joined(imported.cameras) + ").");
  for (const std::string& note : imported.notes) text += comment(note);
  return text + calibration_to_text(imported.rig);
}

nlohmann::ordered_json json_of(const Arguments& arguments, const ImportedCalibration& imported) {
  nlohmann::ordered_json lenses = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < imported.rig.lenses.size(); ++i) {
    const LensParameters& lens = imported.rig.lenses[i];
    lenses.push_back({{"camera", imported.cameras[i]},
                      {"model", model_name(lens.model)},
                      {"width", lens.width},
                      {"height", lens.height},
                      {"max_angle_deg", json_number(lens.max_angle_rad / kDegree)}});
  }
  return {{"input", arguments.input},
          {"kind", to_string(imported.kind)},
          {"output", arguments.output},
          {"lenses", std::move(lenses)},
          {"notes", imported.notes}};
}

}  // namespace

int import_command(const std::vector<std::string>& arguments) {
  CLI::App app{"Imports camera calibrations of other programs.", "lightwell-calibrate import"};
  app.footer(kFooter);
  Arguments in;
  double max_angle_deg = 0;
  const auto not_empty = [](const std::string& path) { return path.empty() ? "the name of the file is empty" : ""; };
  app.add_option("INPUT", in.input, "The calibration to import")->required()->check(not_empty);
  app.add_option("--output", in.output,
                 "The calibration (proto/lightwell/v1/calibration.proto, text format);\n"
                 "- is standard output. Replaced atomically")
      ->type_name("FILE")
      ->required()
      ->check(not_empty);
  add_parsed_option(app, "--kind", in.options.kind, parse_import_kind, "opencv, kalibr or ros [by the content]")
      ->type_name("KIND");
  app.add_option("--camera", in.options.camera, "Only camN of a camchain [one camera, or a pair]")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber);
  const CLI::Option* max_angle =
      app.add_option("--max-angle-deg", max_angle_deg,
                     "Half the field of view, limited to the range of the model. No format contains it:\n"
                     "[the largest angle inside the largest circle around the principal point that\n"
                     "fits into the picture]")
          ->type_name("A")
          ->check(number_where("above 0 and at most 180", [](double deg) { return deg > 0 && deg <= 180; }));
  app.add_flag("--json", in.json, "A description of the result as JSON on standard output");
  return run_command(app, arguments, [&] {
    if (in.json && in.output == "-")
      throw UsageError("--json and --output - both use standard output; give another --output");
    if (*max_angle) in.options.max_angle_rad = max_angle_deg * kDegree;

    const ImportedCalibration imported = require(import_calibration_file(in.input, in.options));
    const std::string text = file_text(in, imported);
    // Check that the firmware can parse the result before it replaces an existing file.
    require(parse_calibration(text, in.output).status());
    require(write_output(in.output, text));
    for (const std::string& note : imported.notes) std::cerr << app.get_name() << ": " << note << "\n";
    if (in.json) require(write_output("-", json_text(json_of(in, imported)) + "\n"));
    return kDone;
  });
}

}  // namespace lightwell::calibrate
