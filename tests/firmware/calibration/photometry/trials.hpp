// A calibration done over and over with other noise: how far off it was at worst, and how often the truth lay within
// three of the deviations that it stated.
#pragma once

#include <string>
#include <vector>

namespace lightwell::photometry {

struct ParameterFigure {
  std::string name;
  double worst = 0;   ///< Largest error of all trials, in the unit that the trial names.
  double inside = 0;  ///< Share of trials with the truth within three stated deviations.
  int trials = 0;
};

/// The curve from nine exposures, known to a thousandth, of three decades of shades, 5 % of which move. Errors: RMS
/// over the scale of the linear value, share of full scale ("curve"); of gamma relative. Inside: gamma, and of a free
/// curve the knot that was inside least often ("worst_knot").
enum class ResponseCase { srgb8, gamma8, toe8, linear12, gamma12, toe12 };
[[nodiscard]] const char* to_string(ResponseCase which);
[[nodiscard]] std::vector<ParameterFigure> response_trials(ResponseCase which, int trials);

/// Four dark pictures and pairs at seven levels. "black" in shares of full scale, "read" of the dark alone,
/// "read_noise" and "shot_noise" of both together, relative. 8 bits: sRGB with black at code 0. 12: linear with a black
/// level.
[[nodiscard]] std::vector<ParameterFigure> noise_trials(int bits, int trials);

/// Fifty sightings with 0.3 % of noise over 95 degrees, three of which are wrong. "edge": largest relative error of the
/// curve anywhere in the field; "v1", "v2", "v3" absolute.
[[nodiscard]] std::vector<ParameterFigure> vignetting_trials(int trials);

/// A card of 40x40 pixels in a sensor whose balance is 1.9, 1, 1.4: "red" and "blue" relative; "scale": nits_per_unit
/// with a meter that is off by 4 % (one deviation), relative.
[[nodiscard]] std::vector<ParameterFigure> card_trials(int bits, int trials);

}  // namespace lightwell::photometry
