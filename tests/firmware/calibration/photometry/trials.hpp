// Repeated photometric calibrations with different noise: largest error, and fraction of trials with the truth within
// three of the stated standard deviations.
#pragma once

#include <string>
#include <vector>

namespace lightwell::photometry {

struct ParameterFigure {
  std::string name;
  double worst = 0;   ///< Largest error of all trials, in the unit stated at the function.
  double inside = 0;  ///< Fraction of trials with the truth within three stated standard deviations.
  int trials = 0;
};

/// The curve from nine exposures, known to a thousandth, of a scene with three decades of light, 5 % of which moves.
/// Errors: RMS over the scale of the linear value, fraction of full scale ("curve"); relative, of gamma. Inside: gamma,
/// and for a free curve the knot that was inside least often ("worst_knot").
enum class ResponseCase { srgb8, gamma8, toe8, linear12, gamma12, toe12 };
[[nodiscard]] const char* to_string(ResponseCase which);
[[nodiscard]] std::vector<ParameterFigure> response_trials(ResponseCase which, int trials);

/// Four dark frames and pairs at seven levels. "black" as a fraction of full scale; "read" from the dark frames only;
/// "read_noise" and "shot_noise" from both, relative. 8 bits: sRGB with black at code 0; 12 bits: linear with a black
/// level.
[[nodiscard]] std::vector<ParameterFigure> noise_trials(int bits, int trials);

/// Fifty observations with 0.3 % noise over 95 degrees, three of them outliers. "edge": largest relative error of the
/// curve in the field of view; "v1", "v2", "v3": absolute errors.
[[nodiscard]] std::vector<ParameterFigure> vignetting_trials(int trials);

/// A card of 40x40 pixels and a sensor with white balance 1.9, 1, 1.4: "red" and "blue": relative errors; "scale":
/// relative error of nits_per_unit with a meter error of 4 % (one standard deviation).
[[nodiscard]] std::vector<ParameterFigure> card_trials(int bits, int trials);

}  // namespace lightwell::photometry
