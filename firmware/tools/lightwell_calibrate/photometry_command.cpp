#include "tools/lightwell_calibrate/photometry_command.hpp"

#include <array>
#include <charconv>
#include <iostream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "tools/lightwell_calibrate/output.hpp"
#include "tools/lightwell_calibrate/photometry_print.hpp"
#include "tools/lightwell_calibrate/photometry_report.hpp"
#include "tools/lightwell_calibrate/photometry_steps.hpp"
#include "tools/lightwell_calibrate/arguments.hpp"

namespace lightwell::calibrate {
namespace {

constexpr const char* kFooter = R"(Examples:
  lightwell-calibrate photometry --calibration rig.textproto --dark dark --response series --output rig.textproto
  lightwell-calibrate photometry --calibration rig.textproto --flat flats --lamp turned --output rig.textproto \
      --report report.png
  lightwell-calibrate photometry --calibration rig.textproto --grey card/a.png:300,200,80,60 --lux 540 --albedo 0.18 \
      --output rig.textproto

A folder lists its pictures in frames.csv (file,exposure_s,time_s; also gain, lens, bracket_index, bracket_size):
  dark      lens covered, all at one gain; two pictures or more
  response  a scene that stands still, exposures from nearly dark to nearly white, each about twice the one before
  flat      an evenly lit wall or a diffuser, at three exposures or more, two pictures of each in a row
  lamp      one small constant lamp in a dark room, the camera turned in front of it from the middle to the edge;
            angles.csv (file,angle_deg) has the angles from the axis, without it they are those of the lens's geometry
PNG and JPEG have 8 bits. OpenEXR holds picture values as shares of full scale (of raw files that were converted).
No automatic exposure, no noise reduction; JPEG changes the noise: take flats and darks as PNG or OpenEXR.
White is the light on the grey card: D65, or what --grey-xy says. The factors are relative to green, whose is 1.
Steps that are not given leave their values as in the calibration.
Exit status: 0 done, 1 an input is wrong (standard error says which and how to mend it), 2 wrong usage.)";

template <class T, std::size_t N>
bool numbers(const std::string& text, std::array<T, N>& out) {
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < N; ++i) {
    const auto [stop, error] = std::from_chars(at, end, out[i]);
    if (error != std::errc() || (i + 1 < N ? stop == end || *stop != ',' : stop != end)) return false;
    at = stop + 1;
  }
  return true;
}

int fail(const std::string& what, int exit) {
  std::cerr << "lightwell-calibrate photometry: " << what << "\n";
  return exit;
}

/// IMAGE:x,y,w,h
bool split_grey(const std::string& text, PhotometryInputs& inputs) {
  const auto colon = text.rfind(':');
  std::array<int, 4> r{};
  if (colon == std::string::npos || colon == 0 || !numbers(text.substr(colon + 1), r)) return false;
  inputs.grey = text.substr(0, colon);
  inputs.patch = {r[0], r[1], r[2], r[3]};
  return true;
}

}  // namespace

int photometry_command(std::span<char* const> arguments) {
  CLI::App app{
      "Measures what light becomes in a camera: response, black level, noise, vignetting, white balance, scale.",
      "lightwell-calibrate photometry"};
  app.footer(kFooter);
  PhotometryInputs in;
  std::string calibration, output, report, grey, grey_xy;
  double nits = 0, lux = 0;
  bool json = false;
  app.add_option("--calibration", calibration, "The rig so far: geometry, and photometry to start from")->required();
  app.add_option("--output", output, "The rig with what was measured; replaced whole or not at all")->required();
  app.add_option("--lens", in.lens, "Lens of the rig that the pictures are of [0]");
  app.add_option("--dark", in.dark, "Folder: black level and read noise");
  app.add_option("--response", in.response, "Folder: response curve");
  app.add_option("--flat", in.flat, "Folder: read and shot noise");
  app.add_option("--lamp", in.lamp, "Folder: vignetting");
  app.add_option("--grey", grey,
                 "IMAGE:x,y,w,h, a patch of a grey card: white balance, and what the meter was pointed at");
  auto* xy =
      app.add_option("--grey-xy", grey_xy, "x,y: CIE 1931 chromaticity of the light on the card, where it is not D65");
  auto* seconds =
      app.add_option("--grey-exposure-s", in.grey_exposure_s, "Exposure of that picture [frames.csv beside it]");
  auto* gain = app.add_option("--grey-gain", in.grey_gain, "Gain of that picture [1]");
  auto* of_nits = app.add_option("--nits", nits, "Luminance meter's reading of the patch, cd/m2");
  auto* of_lux = app.add_option("--lux", lux, "Lux meter's reading on the card");
  auto* albedo = app.add_option("--albedo", in.albedo, "The card's share of light sent back, with --lux");
  app.add_option("--meter-deviation", in.meter_deviation, "Relative standard deviation of the meter [0.04]");
  app.add_option("--bits", in.bits, "Bits behind OpenEXR's numbers, 8 to 16 [not rounded]");
  app.add_option("--report", report, "A picture (PNG) of curves and data");
  app.add_flag("--json", json, "What was measured as JSON on standard output");
  try {
    std::vector<std::string> words(arguments.rbegin(), arguments.rend());  // CLI11 takes them from the back.
    app.parse(std::move(words));
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kDone : kUsage;
  }
  const auto usage = [](const std::string& what) { return fail(what + "; see --help", kUsage); };
  if (!grey.empty() && !split_grey(grey, in)) return usage("--grey '" + grey + "' is not IMAGE:x,y,w,h");
  if (in.grey.empty() && (*of_nits || *of_lux || *xy || *seconds || *gain))
    return usage("--nits, --lux and --grey-... speak of a patch; give it with --grey");
  if (*xy) {
    std::array<double, 2> parameters_of{};
    if (!numbers(grey_xy, parameters_of)) return usage("--grey-xy '" + grey_xy + "' is not x,y");
    in.grey_xy = parameters_of;
  }
  if (*of_nits && *of_lux) return usage("give either --nits or --lux");
  if (bool(*of_lux) != bool(*albedo)) return usage("--lux and --albedo go together");
  if (in.bits != 0 && (in.bits < 8 || in.bits > 16)) return usage("--bits must be 8 to 16");
  if (*of_nits) in.nits = nits;
  if (*of_lux) in.lux = lux;
  if (in.dark.empty() && in.response.empty() && in.flat.empty() && in.lamp.empty() && in.grey.empty())
    return usage("nothing to measure: give --dark, --response, --flat, --lamp or --grey");

  const Result<RigParameters> rig = load_calibration(calibration);
  if (!rig) return fail(rig.status().message(), kBadInput);
  const Result<PhotometryRun> run = calibrate_photometry(*rig, in);
  if (!run) return fail(run.status().message(), kBadInput);
  // The report first: a calibration is replaced only when all else went well.
  if (!report.empty())
    if (Status s = write_report(*run, report); !s.ok()) return fail(s.message(), kBadInput);
  if (Status s = write_output(output, calibration_to_text(run->rig)); !s.ok()) return fail(s.message(), kBadInput);
  for (const std::string& note : run->notes) std::cerr << "lightwell-calibrate photometry: " << note << "\n";
  std::cout << (json ? json_of(*run) : text_of(*run)) << std::flush;
  return kDone;
}

}  // namespace lightwell::calibrate
