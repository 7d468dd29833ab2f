// The rows of the figure `extremes`: each estimates generated scenes and reports the worst result. Scenes and seeds are
// fixed; the caller chooses their number, so that unit tests take seconds and figures use more.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "firmware/estimate/extremes/judge.hpp"

namespace lightwell::extremes {

struct ScaleRow {
  Tally tally;
  /// Deviation from exact scaling before encoding, relative to the largest coefficient or the strongest light.
  double worst = 0;
  double worst_irradiance = 0;  ///< The same for irradiance at any normal, relative to its RMS.
  std::string worst_case, worst_irradiance_case;
};
/// Powers of two near each decade scale floats exactly; decades round each pixel, which may then cross a threshold.
enum class Steps { powers_of_two, decades };
/// Floats times 1e-8 to 1e8.
[[nodiscard]] ScaleRow radiance_scaled(int rooms, Steps steps);
/// The same codes with stated exposures of 1e-8 to 1e8 times the true one.
[[nodiscard]] ScaleRow exposure_scaled(int rooms);

struct TurnRow {
  Tally tally;
  double worst = 0;                ///< Relative RMS difference of irradiance from that of the probe before rotation.
  int beyond_both_bounds = 0;      ///< Cases in which this difference exceeds the sum of both bounds.
  double worst_direction_deg = 0;  ///< Of the strongest light.
};
[[nodiscard]] TurnRow turned_rooms(int rooms, int turns);

/// rgb_f32 or rgb8.
[[nodiscard]] Tally all_black(PixelFormat format);
[[nodiscard]] Tally all_saturated();

struct SpotRow {
  Tally tally;
  double worst_direction_deg = 0;
  double worst_energy = 0;  ///< Relative error of the irradiance.
  int lost = 0;             ///< Cases without a light within 5 degrees of the spot.
  std::string worst_case;
};
/// A random pixel of 1e3 to 1e8 times the rest. Direction errors are relative to that pixel's middle.
[[nodiscard]] SpotRow hot_pixel(int places);

enum class Place { pole, seam, lens_edge, between_lenses };
[[nodiscard]] const char* name_of(Place place);
/// A disc of half a degree at 1e5 times the mean, in a rig of this kind. `width`: of one lens's image (4:3; equirect
/// 2:1). Returns one row per place.
[[nodiscard]] std::vector<SpotRow> suns(const char* kind, int width, std::span<const Place> places);

/// Discs of 1000 times their surroundings. Direction errors are relative to the disc's true centre.
[[nodiscard]] SpotRow light_direction(const RigParameters& rig, double diameter_deg, int anywhere, Setting setting);

struct TwoLightsRow {
  Tally tally;
  double worst_energy = 0;  ///< Relative change of the energy from frame to frame, minus that of the truth.
  double worst_jump = 0;    ///< Relative RMS change of irradiance from frame to frame, minus that of the truth.
  int tracks = 0;           ///< Number of tracks: 2, or 3 where one is new after separation.
  int swaps = 0;            ///< Tracks that changed from one lamp to the other while both were separated.
  int flickers = 0;         ///< Selections (lights, band) that changed and changed back within ten frames.
  int choices = 0;          ///< Changes of the selection.
  std::string worst_case;
};
/// Two lamps 20 degrees apart approach to 0 and separate again, 0.1 degrees per frame, 30 frames/s. `second`: radiance
/// of the second lamp relative to the first.
[[nodiscard]] TwoLightsRow two_lights(const EstimatorConfig& config, PixelFormat format, double second);

[[nodiscard]] Tally thousand_lights(int scenes);

/// NaN, infinite and negative values.
enum class Extent { one_pixel, one_row, everywhere };
[[nodiscard]] const char* name_of(Extent extent);
[[nodiscard]] Tally nonsense(Extent extent);
/// Values near the limits of float.
[[nodiscard]] Tally huge();
/// One pixel of 1e9 to 1e30 in one or all channels, the rest 1.
[[nodiscard]] Tally bright_pixel_on_the_wire();
/// Random bits.
[[nodiscard]] Tally random_bits(int frames);

struct SightRow {
  Tally tally;
  double worst = 0;
  std::string worst_case;
};
/// Exposures and gains of 0, infinity, NaN, negative values, and 1e-300 to 1e300 times the true one. `worst`: deviation
/// from scaling of those that were not refused.
[[nodiscard]] SightRow exposures();
/// Image sizes from 1x1. `worst`: error of the irradiance of a constant sphere.
[[nodiscard]] SightRow sizes();
/// Lenses that see 0 to 49 % of the sphere. `worst`: error of `coverage`.
[[nodiscard]] SightRow coverage();
/// One camera of two is missing, or both.
[[nodiscard]] SightRow camera_gone();

struct DriftRow {
  Tally tally;
  // Relative differences of irradiance.
  double still = 0;  ///< The same image repeatedly: last frame compared with the tenth.
  double noisy = 0;  ///< A cycle of noisy images: mean of the last cycle compared with that of the third.
  double lamp = 0;   ///< A circling, switched lamp: last round compared with the third, worst frame.
  std::uint32_t highest_track = 0;  ///< Of that lamp.
};
[[nodiscard]] DriftRow many_frames(int frames);

}  // namespace lightwell::extremes
