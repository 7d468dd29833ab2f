#include "calibration/solve/photometry/white_balance.hpp"

#include <cmath>
#include <string>

namespace lightwell::photometry {

Result<std::array<double, 3>> rgb_of_chromaticity(double x, double y) {
  // XYZ to linear RGB, IEC 61966-2-1, 5.2.
  const double xn = x / y, zn = (1 - x - y) / y;
  const std::array<double, 3> rgb{3.2406255 * xn - 1.5372080 - 0.4986286 * zn,
                                  -0.9689307 * xn + 1.8757561 + 0.0415175 * zn,
                                  0.0557101 * xn - 0.2040211 + 1.0569959 * zn};
  for (const double c : rgb)
    if (!(c > 0.01) || !std::isfinite(c))
      return Status(StatusCode::invalid_argument, "white balance: the chromaticity " + std::to_string(x) + ", " +
                                                      std::to_string(y) + " is outside the gamut of Rec. 709");
  return rgb;
}

Result<WhiteBalance> solve_white_balance(const PatchMean& card, const std::array<double, 3>& illuminant) {
  for (std::size_t c = 0; c < 3; ++c)
    if (!(card.mean[c] > 0) || !std::isfinite(card.mean[c]) || !(illuminant[c] > 0) || !std::isfinite(illuminant[c]) ||
        !(card.deviation[c] >= 0))
      return Status(StatusCode::invalid_argument,
                    "white balance: a channel of the card or of its light is not positive");
  WhiteBalance out;
  const double green = card.deviation[1] / card.mean[1];
  std::array<double, 3> own{};
  for (std::size_t c = 0; c < 3; ++c) {
    out.factors[c] = c == 1 ? 1 : card.mean[1] / card.mean[c] * illuminant[c] / illuminant[1];
    own[c] = card.deviation[c] / card.mean[c];
  }
  const double red = out.factors[0], blue = out.factors[2];
  out.covariance = {red * red * (own[0] * own[0] + green * green), red * blue * green * green,
                    red * blue * green * green, blue * blue * (own[2] * own[2] + green * green)};
  return out;
}

}  // namespace lightwell::photometry
