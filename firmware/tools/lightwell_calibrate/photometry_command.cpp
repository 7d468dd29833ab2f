#include "tools/lightwell_calibrate/photometry_command.hpp"

#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/text.hpp>

#include "tools/command_line.hpp"
#include "tools/lightwell_calibrate/output.hpp"
#include "tools/lightwell_calibrate/photometry_print.hpp"
#include "tools/lightwell_calibrate/photometry_steps.hpp"

namespace lightwell::calibrate {
namespace {

constexpr const char* kFooter = R"(Examples:
  lightwell-calibrate photometry --calibration rig.textproto --dark dark --response series --output rig.textproto
  lightwell-calibrate photometry --calibration rig.textproto --flat flats --lamp turned --output rig.textproto \
      --json | lightwell_plot.py --output curves.png                        draws curves and data
  lightwell-calibrate photometry --calibration rig.textproto --grey card/a.png:300,200,80,60 --lux 540 --albedo 0.18 \
      --output rig.textproto

A folder lists its pictures in frames.csv (file,exposure_s,time_s; also gain, lens, bracket_index, bracket_size):
  dark      lens covered, all with the same gain; two pictures or more
  response  a static scene, exposures from nearly dark to nearly white, each about twice the one before
  flat      an evenly lit wall or a diffuser, three exposures or more, two successive pictures of each
  lamp      one small constant lamp in a dark room; rotate the camera so that it moves from the centre to the edge;
            angles.csv (file,angle_deg) has the angles from the axis, otherwise the lens's geometry gives them
PNG and JPEG have 8 bits. OpenEXR has picture values relative to full scale (from converted raw files).
No automatic exposure, no noise reduction; JPEG changes the noise: take flats and darks as PNG or OpenEXR.
White is the light on the grey card: D65, or that of --grey-xy. The factors are relative to green.
Steps without input keep the values of the calibration.
Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.)";

/// Parses IMAGE:x,y,w,h.
bool split_grey(const std::string& text, PhotometryInputs& inputs) {
  const auto colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return false;
  const auto r = parse_numbers<int, 4>(std::string_view(text).substr(colon + 1));
  if (!r) return false;
  inputs.grey = text.substr(0, colon);
  inputs.patch = {(*r)[0], (*r)[1], (*r)[2], (*r)[3]};
  return true;
}

}  // namespace

int photometry_command(const std::vector<std::string>& arguments) {
  CLI::App app{"Calibrates the photometry of a camera: response, black level, noise, vignetting, white balance, scale.",
               "lightwell-calibrate photometry"};
  app.footer(kFooter);
  PhotometryInputs in;
  std::string calibration, output, grey, grey_xy;
  double nits = 0, lux = 0;
  bool json = false;
  app.add_option("--calibration", calibration, "The present rig: geometry, and photometry to start from")->required();
  app.add_option("--output", output, "The rig with the measured photometry; replaced atomically")->required();
  app.add_option("--lens", in.lens, "Lens of the rig that took the pictures [0]");
  app.add_option("--dark", in.dark, "Folder: black level and read noise");
  app.add_option("--response", in.response, "Folder: response curve");
  app.add_option("--flat", in.flat, "Folder: read and shot noise");
  app.add_option("--lamp", in.lamp, "Folder: vignetting");
  app.add_option("--grey", grey, "IMAGE:x,y,w,h, a patch of a grey card: white balance, and the target of the meter");
  auto* xy = app.add_option("--grey-xy", grey_xy, "x,y: CIE 1931 chromaticity of the light on the card [D65]");
  auto* seconds =
      app.add_option("--grey-exposure-s", in.grey_exposure_s, "Exposure of that picture [frames.csv beside it]");
  auto* gain = app.add_option("--grey-gain", in.grey_gain, "Gain of that picture [1]");
  auto* of_nits = app.add_option("--nits", nits, "Luminance meter's reading of the patch, cd/m2");
  auto* of_lux = app.add_option("--lux", lux, "Lux meter's reading on the card");
  auto* albedo = app.add_option("--albedo", in.albedo, "The card's albedo (reflectance), with --lux");
  app.add_option("--meter-deviation", in.meter_deviation, "Relative standard deviation of the meter [0.04]");
  app.add_option("--bits", in.bits, "Bit depth of the values in OpenEXR, 8 to 16 [not quantised]");
  app.add_flag("--json", json, "Print the result as JSON on standard output; lightwell_plot.py draws it");
  if (const auto exit = parse_command_line(app, arguments)) return *exit;
  const auto usage = [&app](const std::string& what) { return wrong_usage(app, what); };
  if (!grey.empty() && !split_grey(grey, in)) return usage("--grey '" + grey + "' is not IMAGE:x,y,w,h");
  if (in.grey.empty() && (*of_nits || *of_lux || *xy || *seconds || *gain))
    return usage("--nits, --lux and --grey-... need a patch; give it with --grey");
  if (*xy && !(in.grey_xy = parse_numbers<double, 2>(grey_xy))) return usage("--grey-xy '" + grey_xy + "' is not x,y");
  if (*of_nits && *of_lux) return usage("give either --nits or --lux");
  if (bool(*of_lux) != bool(*albedo)) return usage("--lux and --albedo go together");
  if (in.bits != 0 && (in.bits < 8 || in.bits > 16)) return usage("--bits must be 8 to 16");
  if (*of_nits) in.nits = nits;
  if (*of_lux) in.lux = lux;
  if (in.dark.empty() && in.response.empty() && in.flat.empty() && in.lamp.empty() && in.grey.empty())
    return usage("nothing to measure: give --dark, --response, --flat, --lamp or --grey");

  const Result<RigParameters> rig = load_calibration(calibration);
  if (!rig) return bad_input(app, rig.status());
  const Result<PhotometryRun> run = calibrate_photometry(*rig, in);
  if (!run) return bad_input(app, run.status());
  if (Status s = write_output(output, calibration_to_text(run->rig)); !s.ok()) return bad_input(app, s);
  for (const std::string& note : run->notes) std::cerr << app.get_name() << ": " << note << "\n";
  std::cout << (json ? json_of(*run) : to_text(*run)) << std::flush;
  return kDone;
}

}  // namespace lightwell::calibrate
