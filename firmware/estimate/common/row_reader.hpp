// Linear radiance of a run of pixels of any format, merged from any number of exposures, pixel by pixel. The vectorised
// passes of panorama/ (code_pass, bracket_pass, code_weights, row_profiler) decode integer formats without it.
#pragma once

#include <array>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/lens_table.hpp"
#include "camera/frame.hpp"

namespace lightwell::estimate {

class BlockLayout;

/// A run of pixels of one row. Planar, so that sums over rows vectorise.
struct LinearRow {
  std::vector<float> r, g, b;   ///< Radiance in units of (linear value / (exposure_s * gain * vignetting)).
  std::vector<float> variance;  ///< Of the radiance, luminance-like: one number for the three channels.
  std::vector<float> bias;      ///< Near black, what rounding to codes and cutting off noise may hide, all one way.
  std::vector<std::uint8_t> clipped;  ///< 1 where every exposure was saturated: the radiance is at least this.
  bool certain = false;  ///< No variance, no bias, nothing clipped: the three above are all zero and need no look.

  explicit LinearRow(int width);
};

/// How much of a linear value near black may be missing or too much for every pixel alike. `step`: to the next code;
/// `cut_noise`: deviation of noise where it is cut off at black.
[[nodiscard]] float near_black_bias(float x, float step, float cut_noise);

/// What reading found in a bracket.
struct ReadStatistics {
  std::uint64_t cleaned = 0;  ///< Pixels with NaN, infinite or negative radiance.
};

/// Reads brackets of one rig, one after another.
class RowReader {
 public:
  /// Radiance beyond this counts as infinite: integrals of it must stay numbers that the wire can hold.
  static constexpr float kMaxRadiance = 1e30F;

  /// What read() fills: radiance alone, or clipped too, or all.
  enum class Reading { radiance, with_clipped, with_errors };

  explicit RowReader(const RigParameters& rig, const RigTable& table);

  /// invalid_argument where the frames do not fit the rig or each other. The frames must stay until the next bind().
  [[nodiscard]] Status bind(std::span<const Frame> bracket);

  /// A camera of a pair may be gone: its lens is then not in the bracket.
  [[nodiscard]] bool has(int lens) const { return (present_lenses_ >> lens & 1U) != 0; }

  /// How many pixels share one sample of colour in the bracket that is bound: where a small light falls within them,
  /// its colour and energy do not tell.
  [[nodiscard]] int pixels_per_color() const;
  /// Whether luma is each pixel's own although colour is shared.
  [[nodiscard]] bool has_luma() const;

  /// Until the next bind(), reads take of the block that they begin in only as many of the shortest exposures as
  /// `exposures` says, and must not reach beyond it. Both must stay until then.
  void limit_exposures_per_block(const BlockLayout& layout, std::span<const std::uint8_t> exposures);

  /// Pixel `first` of row y where the bracket is one picture of floats, which are radiance but for a factor; else null.
  [[nodiscard]] const std::byte* floats(int lens, int y, int first) const;
  [[nodiscard]] float scale_of_floats() const { return exposures_[0].radiance_per_linear; }

  /// Pixels [first, end) of row y of a lens into entries 0 to end - first of `out`. Several exposures are merged by the
  /// inverse of each one's variance of radiance (read and shot noise, rounding); saturated values have no weight.
  void read(int lens, int y, int first, int end, Reading what, LinearRow& out, ReadStatistics& counts);

 private:
  /// By picture value of one depth.
  struct CodeTable {
    std::vector<float> linear;
    std::vector<float> step;  ///< To the next value below, by which rounding is judged.
    unsigned saturated_from = 0;

    CodeTable(const PhotometricCalibration& photometry, int levels, float values_per_step);
  };
  struct Tables {
    CodeTable code8, code10, code12;
  };
  struct Exposure {
    std::array<View, kMaxLenses> view;
    float radiance_per_linear = 1;  ///< 1 / (exposure_s * gain)
  };

  /// What load() fills besides the linear values: nothing; the steps and what is saturated; and so that pixels that
  /// share their colour with a saturated one count as saturated, as it is wrong there.
  enum class SaturationHandling { none, own, shared };
  void load(const View& view, const Tables& tables, int y, int first, int end, SaturationHandling saturation);

  const RigParameters& rig_;
  const RigTable& table_;
  std::vector<Tables> tables_;
  std::array<Exposure, kMaxBracket> exposures_{};  ///< Shortest first.
  std::size_t exposure_count_ = 0;
  const BlockLayout* layout_ = nullptr;  ///< Null: all exposures count everywhere.
  std::span<const std::uint8_t> taken_;
  unsigned present_lenses_ = 0;  ///< A bit each.
  // One exposure's linear values, 0 to 1, the size of a value's step and whether it is saturated.
  std::vector<float> x_[3], step_;
  std::vector<std::uint8_t> saturated_;
  std::vector<float> weight_, ones_;
};

}  // namespace lightwell::estimate
