// The rows of the figure `extremes`: each looks at generated light and says what the worst answer was. Scenes and seeds
// are fixed in here; how many of them is the caller's choice, so that unit tests take seconds and figures look longer.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "firmware/estimate/extremes/judge.hpp"

namespace lightwell::extremes {

struct ScaleRow {
  Tally tally;
  double worst = 0;  ///< Deviation from scaling, of the largest coefficient or the strongest light; before the wire.
  double worst_irradiance = 0;  ///< The same of irradiance at any normal, of its RMS.
  std::string worst_case, worst_irradiance_case;
};
/// Factors of two near each decade scale floats to the bit; decades round each pixel, which may then be on the other
/// side of a threshold.
enum class Steps { powers_of_two, decades };
/// Floats times 1e-8 to 1e8.
[[nodiscard]] ScaleRow radiance_scaled(int rooms, Steps steps);
/// The same codes said to be exposed 1e-8 to 1e8 times as long.
[[nodiscard]] ScaleRow exposure_scaled(int rooms);

struct TurnRow {
  Tally tally;
  double worst = 0;            ///< Irradiance, turned back, against that of the probe that did not turn, relative RMS.
  int beyond_both_bounds = 0;  ///< Turned and not, that no one truth is within both bounds of.
  double worst_direction_deg = 0;  ///< Of the strongest light.
};
[[nodiscard]] TurnRow turned_rooms(int rooms, int turns);

/// rgb_f32 or rgb8.
[[nodiscard]] Tally all_black(PixelFormat format);
[[nodiscard]] Tally all_saturated();

struct SpotRow {
  Tally tally;
  double worst_direction_deg = 0;
  double worst_energy = 0;  ///< Relative.
  int lost = 0;             ///< No light within 5 degrees of it.
  std::string worst_case;
};
/// A pixel of 1e3 to 1e8 times the rest, anywhere; direction in degrees beside that pixel's middle.
[[nodiscard]] SpotRow hot_pixel(int places);

enum class Place { pole, seam, lens_edge, between_lenses };
[[nodiscard]] const char* name_of(Place place);
/// A disc of half a degree at 1e5 times the mean, in a rig of this kind; `width` of one lens's picture, of 4:3. A row a
/// place, in the order of `places`.
[[nodiscard]] std::vector<SpotRow> suns(const char* kind, int width, std::span<const Place> places);

/// Discs of 1000 times their surroundings. Direction beside the disc's true middle.
[[nodiscard]] SpotRow light_direction(const RigParameters& rig, double diameter_deg, int anywhere, Setting setting);

struct TwoLightsRow {
  Tally tally;
  double worst_energy = 0;  ///< Change of the energy from frame to frame, relative, beside that of the truth.
  double worst_jump = 0;    ///< Of irradiance over normals from frame to frame, relative RMS, less that of the truth.
  int tracks = 0;    ///< Different numbers that were given, of two lamps: 2, or 3 where one is new after parting.
  int swaps = 0;     ///< A number that went from one lamp to the other while both were told apart.
  int flickers = 0;  ///< The choice (lights, band) left and came back within ten frames.
  int choices = 0;   ///< How often it changed.
  std::string worst_case;
};
/// From 20 degrees to 0 and back, a tenth of a degree a frame, 30 frames a second. `second`: of the first one's light.
[[nodiscard]] TwoLightsRow two_lights(const EstimatorConfig& config, PixelFormat format, double second);

[[nodiscard]] Tally thousand_lights(int scenes);

/// NaN, infinities and negative numbers.
enum class Extent { one_pixel, one_row, everywhere };
[[nodiscard]] const char* name_of(Extent extent);
[[nodiscard]] Tally nonsense(Extent extent);
/// Numbers near the end of what a float holds.
[[nodiscard]] Tally huge();
/// One pixel of 1e9 to 1e30 in one channel or all, the rest 1.
[[nodiscard]] Tally bright_pixel_on_the_wire();
/// Any bits at all.
[[nodiscard]] Tally random_bits(int frames);

struct SightRow {
  Tally tally;
  double worst = 0;
  std::string worst_case;
};
/// 0, infinite, NaN, negative, 1e-30, 1e30 s and gain. `worst`: deviation from scaling of those that were answered.
[[nodiscard]] SightRow exposures();
/// From 1x1. `worst`: error of irradiance of a constant sphere.
[[nodiscard]] SightRow sizes();
/// Lenses that see 0 to 49 %. `worst`: of the stated share of the sphere.
[[nodiscard]] SightRow coverage();
/// One camera of two is gone, or both.
[[nodiscard]] SightRow camera_gone();

struct DriftRow {
  Tally tally;
  double still = 0;  ///< Of irradiance of one picture over and over, last frame against the tenth, relative.
  double noisy = 0;  ///< Of a cycle of noisy pictures, last cycle's mean against the third's, relative.
  double lamp = 0;   ///< Of a lamp that goes around and switches, last round against the third, relative, at any frame.
  std::uint32_t highest_track = 0;  ///< That such a lamp was given.
};
[[nodiscard]] DriftRow many_frames(int frames);

}  // namespace lightwell::extremes
