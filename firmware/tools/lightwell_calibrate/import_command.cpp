#include "tools/lightwell_calibrate/import_command.hpp"

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "calibration/solve/import/import.hpp"
#include "tools/lightwell_calibrate/arguments.hpp"
#include "tools/lightwell_calibrate/json.hpp"
#include "tools/lightwell_calibrate/output.hpp"

namespace lightwell::calibrate {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

constexpr const char* kHelp = R"(lightwell-calibrate import: imports camera calibrations of other programs.

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
  --output FILE         the calibration (proto/lightwell/v1/calibration.proto, text format); - is standard output.
                        Replaced atomically
  --kind KIND           opencv, kalibr or ros [by the content]
  --camera N            only camN of a camchain [one camera, or a pair]
  --max-angle-deg A     half the field of view, limited to the range of the model. No format contains it: [the largest
                        angle inside the largest circle around the principal point that fits into the picture]
  --json                a description of the result as JSON on standard output
  --help                this text

These files contain no response, vignetting and noise: the lens is written with a linear response; measure them.
Notes on assumptions go to standard error and, as comments, into the file.
Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.
)";

struct Arguments {
  std::string input, output;
  ImportOptions options;
  bool json = false;
  bool help = false;
};

Status usage(const std::string& what) { return {StatusCode::invalid_argument, what + "; see --help"}; }

/// Applies one option with its value.
Status take(const std::string& option, const std::string& value, Arguments& out) {
  const auto bad = [&](const std::string& known) {
    return usage(option + ": '" + value + "' is not a valid value; allowed are " + known);
  };
  if (option == "--output") {
    if (!out.output.empty()) return usage("--output is given twice");
    if (value.empty()) return usage("--output needs a file");
    out.output = value;
  } else if (option == "--kind") {
    out.options.kind = import_kind(value);
    if (!out.options.kind) return bad("opencv, kalibr, ros");
  } else if (option == "--camera") {
    out.options.camera = number<int>(value);
    if (!out.options.camera || *out.options.camera < 0) return bad("0, 1, 2 ...");
  } else {
    const auto degrees = number<double>(value);
    if (!degrees) return bad("degrees");
    out.options.max_angle_rad = *degrees * kDegree;
    if (!out.options.validate().ok()) return bad("above 0 and at most 180 (half the field of view)");
  }
  return {};
}

Result<Arguments> parse(std::span<char* const> arguments) {
  const Result<std::vector<Argument>> words =
      parse_arguments(arguments, {"--output", "--kind", "--camera", "--max-angle-deg"}, {"--json"});
  if (!words) return words.status();
  Arguments out;
  for (const auto& [option, value] : *words) {
    if (option == "--help") {
      out.help = true;
      return out;
    }
    if (option == "--json") {
      out.json = true;
    } else if (option.empty()) {
      if (!out.input.empty())
        return usage("two files are given, " + out.input + " and '" + value + "'; import one at a time");
      if (value.empty()) return usage("the name of the input file is empty");
      out.input = value;
    } else if (Status s = take(option, value, out); !s.ok()) {
      return s;
    }
  }
  if (out.input.empty()) return usage("no input file; give the calibration to import");
  if (out.output.empty()) return usage("no output file; give --output");
  if (out.json && out.output == "-")
    return usage("--json and --output - both use standard output; give another --output");
  return out;
}

/// A comment of one line; replaces line breaks in names from the file.
std::string comment(const std::string& text) {
  std::string out = "# " + text;
  std::replace_if(
      out.begin() + 2, out.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  return out + "\n";
}

std::string file_text(const Arguments& arguments, const ImportedCalibration& imported) {
  std::string cameras;
  for (const std::string& c : imported.cameras) cameras += (cameras.empty() ? "" : ", ") + c;
  std::string text = comment("Imported by lightwell-calibrate from " + arguments.input + " (" +
                             std::string(to_string(imported.kind)) + ": " + cameras + ").");
  for (const std::string& note : imported.notes) text += comment(note);
  return text + calibration_to_text(imported.rig);
}

std::string json_of(const Arguments& arguments, const ImportedCalibration& imported) {
  std::string out = "{\"input\": " + json_string(arguments.input) + ", \"kind\": \"" +
                    std::string(to_string(imported.kind)) + "\", \"output\": " + json_string(arguments.output) +
                    ",\n \"lenses\": [";
  for (std::size_t i = 0; i < imported.rig.lenses.size(); ++i) {
    const LensParameters& lens = imported.rig.lenses[i];
    char numbers[96];
    std::snprintf(numbers, sizeof numbers, "\"width\": %d, \"height\": %d, \"max_angle_deg\": %.9g", lens.width,
                  lens.height, lens.max_angle_rad / kDegree);
    out += (i > 0 ? ",\n  " : "\n  ") + std::string("{\"camera\": ") + json_string(imported.cameras[i]) +
           ", \"model\": \"" + std::string(model_name(lens.model)) + "\", " + numbers + "}";
  }
  out += "],\n \"notes\": [";
  for (std::size_t i = 0; i < imported.notes.size(); ++i)
    out += (i > 0 ? ",\n  " : "\n  ") + json_string(imported.notes[i]);
  return out + "]}\n";
}

}  // namespace

int import_command(std::span<char* const> arguments) {
  const auto fail = [](const Status& s, int exit) {
    std::cerr << "lightwell-calibrate import: " << s.message() << "\n";
    return exit;
  };
  const Result<Arguments> parsed = parse(arguments);
  if (!parsed) return fail(parsed.status(), kUsage);
  if (parsed->help) {
    std::cout << kHelp;
    return kDone;
  }
  const Result<ImportedCalibration> imported = import_calibration_file(parsed->input, parsed->options);
  if (!imported) return fail(imported.status(), kBadInput);
  const std::string text = file_text(*parsed, *imported);
  // Check that the firmware can parse the result before it replaces an existing file.
  if (const Result<RigParameters> back = parse_calibration(text, parsed->output); !back)
    return fail(back.status(), kBadInput);
  if (const Status s = write_output(parsed->output, text); !s.ok()) return fail(s, kBadInput);
  for (const std::string& note : imported->notes) std::cerr << "lightwell-calibrate import: " << note << "\n";
  if (parsed->json) {
    if (const Status s = write_output("-", json_of(*parsed, *imported)); !s.ok()) return fail(s, kBadInput);
  }
  return kDone;
}

}  // namespace lightwell::calibrate
