#include "tools/lightwell_calibrate/import_command.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <iterator>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "calibration/import/import.hpp"

namespace lightwell {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

constexpr const char* kHelp = R"(lightwell-calibrate import: other programs' camera calibrations.

  lightwell-calibrate import camchain.yaml --output rig.textproto
  lightwell-calibrate import camchain.yaml --camera 1 --output lens.textproto
  lightwell-calibrate import out_camera_params.xml --kind opencv --max-angle-deg 97.5 --output rig.textproto --json

Reads
  opencv   cv::FileStorage, YAML or XML: fisheye (4 coefficients) and omnidir (xi). Its omnidir samples leave the size
           out: add image_width and image_height.
  kalibr   a camchain: pinhole-equidistant, ds-none, omni-none, omni-radtan. Two cameras become a pair whose -Z is the
           first one's axis, with the origin midway.
  ros      sensor_msgs/CameraInfo as YAML: equidistant (fisheye); binning and region of interest are followed.
Lenses with radtan or plumb_bob are taken where k1 k2 p1 p2 say all, and refused otherwise.
  --output FILE         where the calibration goes (proto/lightwell/v1/calibration.proto, text format); - is standard
                        output. Written over where it is there
  --kind KIND           opencv, kalibr or ros [told by the content]
  --camera N            camN of a camchain alone [one camera, or a pair]
  --max-angle-deg A     half the field of view, lowered to where the model ends. No format knows it: [the largest angle
                        inside the largest circle round the principal point that fits into the picture]
  --json                what was imported, as JSON on standard output
  --help                this text

Response, vignetting and noise are not in these files: the lens is written with a linear sensor, to be measured.
Notes on what was assumed go to standard error and, as comments, into the file.
Exit status: 0 done, 1 an input is wrong (standard error says which and how to mend it), 2 wrong usage.
)";

enum Exit : int { kOk = 0, kBadInput = 1, kUsage = 2 };

struct Arguments {
  std::string input, output;
  ImportOptions options;
  bool json = false;
  bool help = false;
};

template <class T>
std::optional<T> number(const std::string& text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

Status usage(const std::string& what) { return {StatusCode::invalid_argument, what + "; see --help"}; }

/// One option with its value.
Status take(const std::string& option, const std::string& value, Arguments& out) {
  const auto bad = [&](const std::string& known) {
    return usage(option + ": '" + value + "' is not a value it can take, which are " + known);
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

Result<Arguments> parse(const std::vector<std::string>& words) {
  static constexpr std::string_view kWithValue[] = {"--output", "--kind", "--camera", "--max-angle-deg"};
  Arguments out;
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::string word = words[i];
    if (word == "--help" || word == "-h") {
      out.help = true;
      return out;
    }
    if (word == "--json") {
      out.json = true;
      continue;
    }
    if (word.empty() || word[0] != '-') {
      if (!out.input.empty()) return usage("one file at a time, not " + out.input + " and '" + word + "'");
      if (word.empty()) return usage("an empty word where a file is expected");
      out.input = word;
      continue;
    }
    std::optional<std::string> value;
    if (const auto equals = word.find('='); equals != std::string::npos) {
      value = word.substr(equals + 1);
      word.resize(equals);
    }
    if (std::find(std::begin(kWithValue), std::end(kWithValue), word) == std::end(kWithValue))
      return usage("unknown option " + word);
    if (!value && i + 1 < words.size()) value = words[++i];
    if (!value) return usage(word + " needs a value");
    if (Status s = take(word, *value, out); !s.ok()) return s;
  }
  if (out.input.empty()) return usage("which file? Give the calibration to import");
  if (out.output.empty()) return usage("where to? Give --output");
  if (out.json && out.output == "-") return usage("--json and --output - both want standard output");
  return out;
}

/// One line, whatever a file's names contain.
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

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20) {
      char escaped[8];
      std::snprintf(escaped, sizeof escaped, "\\u%04x", static_cast<unsigned>(c));
      out += escaped;
      continue;
    }
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string json_of(const Arguments& arguments, const ImportedCalibration& imported) {
  std::string out = "{\"input\": " + quoted(arguments.input) + ", \"kind\": \"" +
                    std::string(to_string(imported.kind)) + "\", \"output\": " + quoted(arguments.output) +
                    ",\n \"lenses\": [";
  for (std::size_t i = 0; i < imported.rig.lenses.size(); ++i) {
    const LensParameters& lens = imported.rig.lenses[i];
    char numbers[96];
    std::snprintf(numbers, sizeof numbers, "\"width\": %d, \"height\": %d, \"max_angle_deg\": %.9g", lens.width,
                  lens.height, lens.max_angle_rad / kDegree);
    out += (i > 0 ? ",\n  " : "\n  ") + std::string("{\"camera\": ") + quoted(imported.cameras[i]) + ", \"model\": \"" +
           std::string(model_name(lens.model)) + "\", " + numbers + "}";
  }
  out += "],\n \"notes\": [";
  for (std::size_t i = 0; i < imported.notes.size(); ++i) out += (i > 0 ? ",\n  " : "\n  ") + quoted(imported.notes[i]);
  return out + "]}\n";
}

Status write_file(const std::string& path, const std::string& text) {
  if (path == "-") {
    std::cout << text << std::flush;
    return std::cout ? Status() : Status(StatusCode::data_loss, "standard output cannot be written");
  }
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  return out ? Status() : Status(StatusCode::data_loss, path + ": cannot be written");
}

}  // namespace

int import_command(std::span<char* const> arguments) {
  const auto fail = [](const Status& s, int exit) {
    std::cerr << "lightwell-calibrate import: " << s.message() << "\n";
    return exit;
  };
  const Result<Arguments> parsed = parse({arguments.begin(), arguments.end()});
  if (!parsed) return fail(parsed.status(), kUsage);
  if (parsed->help) {
    std::cout << kHelp;
    return kOk;
  }
  const Result<ImportedCalibration> imported = import_calibration_file(parsed->input, parsed->options);
  if (!imported) return fail(imported.status(), kBadInput);
  const std::string text = file_text(*parsed, *imported);
  // What the firmware will read, before it replaces what was there.
  if (const Result<RigParameters> back = parse_calibration(text, parsed->output); !back)
    return fail(back.status(), kBadInput);
  if (const Status s = write_file(parsed->output, text); !s.ok()) return fail(s, kBadInput);
  for (const std::string& note : imported->notes) std::cerr << "lightwell-calibrate import: " << note << "\n";
  if (parsed->json) {
    if (const Status s = write_file("-", json_of(*parsed, *imported)); !s.ok()) return fail(s, kBadInput);
  }
  return kOk;
}

}  // namespace lightwell
