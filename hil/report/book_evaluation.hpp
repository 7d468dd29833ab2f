// What the SDK knows of a captured book and of the light above it, beside the truth of the rendered sequence.
#pragma once

#include <vector>

#include <lightwell/lighting.hpp>
#include <lightwell/plane_appearance.hpp>

#include "measure/specular_sequences.hpp"
#include "report/page.hpp"
#include "report/virtual_balls.hpp"

namespace lightwell::hil {

/// Radiance is that of descriptors; times this it is the sequence's normalised intensity, 1 at the camera's full scale.
inline constexpr double kFullScale = measure::SpecularSequence::kExposure_s;

struct BookNumbers {
  double seen = 0;                 ///< Share of the directions above 10° that was seen.
  double alpha = 0;                ///< Of the gloss; 0: not known.
  double rmse = 0;                 ///< Of the SDK's drawings of held-out views, of full scale, both clipped at 1.
  double rmse_shown = 0;           ///< Of the view in the picture.
  double unseen = 0;               ///< Share of those views' pixels whose direction no frame saw.
  double irradiance_error = 0;     ///< Relative RMS, proto/README.md.
  double irradiance_bound = 0;     ///< The descriptor's.
  double strongest_light_deg = 0;  ///< Angle between the brightest region of the blurred truth and the nearest light.
  double shadow_rms = 0;           ///< Of the ratios of the balls' shadows.
};

/// Pictures of one size, that of the sequence; maps of the upper hemisphere, kMapWidth wide, azimuth as a panorama's.
struct BookPictures {
  static constexpr int kMapWidth = 408;

  LinearPicture real, drawn;          ///< A held-out view, and the SDK's drawing of it.
  LinearPicture light, true_light;    ///< Radiance by direction, blurred by the gloss' lobe.
  LinearPicture balls, true_balls;    ///< Virtual balls in the real view, lit by either.
  LinearPicture shadow, true_shadow;  ///< Of the balls: the ratios, as radiance.
};

struct BookEvaluation {
  BookNumbers numbers;
  BookPictures pictures;
};

/// `light`: in the plane's frame. Takes some seconds.
[[nodiscard]] Result<BookEvaluation> evaluate_book(const measure::SpecularSequence& sequence,
                                                   const PlaneAppearance& plane, const Lighting& light);

}  // namespace lightwell::hil
