// Calibrates simulated cameras a hundred times each and prints one JSON object per line for tests/figures: figure,
// value (the largest error of all trials), unit, inside (share of trials with the truth within three stated standard
// deviations; null if none is stated), trials.
//   measure_photometry response    response.CURVE.curve (RMS, share of full scale), .kind (inside: identified
//                                  correctly), .worst_knot (the free curve), .gamma (relative)
//   measure_photometry noise       noise.BITS.black (share of full scale), .read, .read_noise, .shot_noise (relative)
//   measure_photometry vignetting  vignetting.edge (relative, anywhere in the field), .v1 .v2 .v3
//   measure_photometry card        card.BITS.red, .blue (relative), .scale (relative, without the meter's own error)
//   measure_photometry             all of these
#include <string>

#include <nlohmann/json.hpp>

#include "firmware/calibration/photometry/trials.hpp"
#include "measure/output.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell::photometry;

constexpr int kTrials = 100;

void print(const std::string& prefix, const std::vector<ParameterFigure>& figures, const std::string& absolute) {
  for (const ParameterFigure& f : figures) {
    const bool stated = f.name != "curve" && f.name != "edge";
    const bool relative = absolute.find(" " + f.name + " ") == std::string::npos;
    lightwell::measure::print_line({{"figure", prefix + f.name},
                                    {"value", f.worst},
                                    {"unit", relative ? "relative" : ""},
                                    {"inside", stated ? nlohmann::ordered_json(f.inside) : nlohmann::ordered_json()},
                                    {"trials", f.trials}});
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::string part;
  CLI::App app{"Errors of simulated cameras' photometric calibrations.", "measure_photometry"};
  app.add_option("PART", part, "What is calibrated [all]")
      ->check(CLI::IsMember({"response", "noise", "vignetting", "card"}));
  if (const auto exit = lightwell::parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  if (part.empty() || part == "response")
    for (const ResponseCase which : {ResponseCase::srgb8, ResponseCase::gamma8, ResponseCase::toe8,
                                     ResponseCase::linear12, ResponseCase::gamma12, ResponseCase::toe12})
      print(std::string("response.") + to_string(which) + ".", response_trials(which, kTrials),
            " curve kind worst_knot ");
  if (part.empty() || part == "noise")
    for (const int bits : {8, 12}) print("noise." + std::to_string(bits) + ".", noise_trials(bits, kTrials), " black ");
  if (part.empty() || part == "vignetting") print("vignetting.", vignetting_trials(kTrials), " v1 v2 v3 ");
  if (part.empty() || part == "card")
    for (const int bits : {8, 12}) print("card." + std::to_string(bits) + ".", card_trials(bits, kTrials), " ");
  return 0;
}
