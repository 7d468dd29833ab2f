// Calibrates simulated cameras a hundred times each and prints one JSON object per line for tests/figures: figure,
// value (the largest error of all trials), unit, inside (share of trials with the truth within three stated standard
// deviations; null if none is stated), trials.
//   measure_photometry response    response.CURVE.curve (RMS, share of full scale), .kind (inside: identified
//                                  correctly), .worst_knot (the free curve), .gamma (relative)
//   measure_photometry noise       noise.BITS.black (share of full scale), .read, .read_noise, .shot_noise (relative)
//   measure_photometry vignetting  vignetting.edge (relative, anywhere in the field), .v1 .v2 .v3
//   measure_photometry card        card.BITS.red, .blue (relative), .scale (relative, without the meter's own error)
//   measure_photometry             all of these
#include <cstdio>
#include <string>

#include "firmware/calibration/photometry/trials.hpp"

namespace {

using namespace lightwell::photometry;

constexpr int kTrials = 100;

void print(const std::string& prefix, const std::vector<ParameterFigure>& figures, const std::string& absolute) {
  for (const ParameterFigure& f : figures) {
    const bool stated = f.name != "curve" && f.name != "edge";
    const std::string inside = stated ? std::to_string(f.inside) : "null";
    const std::string unit = absolute.find(" " + f.name + " ") != std::string::npos ? "" : "relative";
    std::printf("{\"figure\": \"%s%s\", \"value\": %.4g, \"unit\": \"%s\", \"inside\": %s, \"trials\": %d}\n",
                prefix.c_str(), f.name.c_str(), f.worst, unit.c_str(), inside.c_str(), f.trials);
  }
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string part = argc > 1 ? argv[1] : "";
  if (argc > 2 || (!part.empty() && part != "response" && part != "noise" && part != "vignetting" && part != "card"))
    return std::fprintf(stderr, "usage: measure_photometry [response|noise|vignetting|card]\n"), 2;
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
