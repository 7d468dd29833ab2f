// Converts a run of pixels of any format to linear radiance, merged from the exposures of a bracket, pixel by pixel.
// The SIMD passes of panorama/ (code_pass, bracket_pass, row_profiler) decode integer formats without it.
#pragma once

#include <array>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/model/lens_table.hpp"
#include "calibration/model/pixel_vignetting.hpp"
#include "imaging/frame.hpp"

namespace lightwell::estimate {

class BlockLayout;

/// A run of pixels of one row, planar, so that loops vectorize.
struct LinearRow {
  std::vector<float> r, g, b;   ///< Radiance in units of (linear value / (exposure_s * gain * vignetting)).
  std::vector<float> variance;  ///< Of the radiance, one value for the three channels.
  std::vector<float> bias;      ///< Possible common bias near black, by rounding to codes and by cutting off noise.
  std::vector<std::uint8_t> clipped;  ///< 1 where every exposure was saturated: the radiance is a lower bound.
  bool certain = false;  ///< Variance, bias and clipped are zero for the whole run, and their arrays are not filled.

  explicit LinearRow(int width);
};

/// First byte of row y of a view; of NV12, rows from `height` on are chroma.
[[nodiscard]] inline const std::uint8_t* row_of(const View& view, int y) {
  return reinterpret_cast<const std::uint8_t*>(view.data.data()) + static_cast<std::size_t>(y) * view.stride;
}

/// Possible bias of a linear value near black that is common to all pixels. `step`: difference to the next code;
/// `cut_noise`: standard deviation of noise that is cut off at black, 0 where it is not.
[[nodiscard]] float near_black_bias(float x, float step, float cut_noise);

/// Statistics of the pixels that were read.
struct ReadStatistics {
  std::uint64_t invalid_pixels = 0;  ///< Pixels with NaN, negative radiance, or radiance above kMaxRadiance.
};

/// Reads brackets of one rig, one after another. Not thread-safe.
class RowReader {
 public:
  /// Radiance above this counts as infinite, so that integrals can be encoded.
  static constexpr float kMaxRadiance = 1e30F;

  /// Members that read() fills: r, g, b; these and `clipped`; or all.
  enum class Reading { radiance, with_clipped, with_errors };

  /// For callers that read most of each picture: vignetting is that of `table`. Refers to both arguments.
  RowReader(const RigParameters& rig, const RigTable& table) : RowReader(rig, &table) {}
  /// For callers that read a small part of each picture: the vignetting of a pixel is evaluated when it is first read.
  explicit RowReader(const RigParameters& rig) : RowReader(rig, nullptr) {}

  /// invalid_argument where the frames do not match the rig or each other. Refers to them until the next bind().
  [[nodiscard]] Status bind(std::span<const Frame> bracket);

  struct Exposure {
    std::array<View, kMaxLenses> view;  ///< By lens; of those that has() says.
    float radiance_per_linear = 1;      ///< 1 / (exposure_s * gain)
  };
  /// Of the first view of the bound bracket that is present.
  [[nodiscard]] const PixelLayout& layout() const { return pixel_layout(exposures_[0].view[has(0) ? 0 : 1].format); }
  /// Of the bound bracket, shortest first.
  [[nodiscard]] std::span<const Exposure> exposures() const { return std::span(exposures_).first(exposure_count_); }

  /// Whether the bracket contains the lens; a camera of a pair may be missing.
  [[nodiscard]] bool has(int lens) const { return (present_lenses_ >> lens & 1U) != 0; }

  /// Pixels that share a chroma sample in the bound bracket: colour and energy of a smaller light are not determined.
  [[nodiscard]] int pixels_per_color() const { return layout().unit_width * layout().unit_height; }
  /// Whether each pixel has its own luma sample although chroma is shared (NV12, YUYV).
  [[nodiscard]] bool has_luma() const { return layout().sampling == ColorSampling::ycbcr; }

  /// Until bind(), reads in block k use the exposures[k] shortest exposures, and stay in it. Refers to its arguments.
  void limit_exposures_per_block(const BlockLayout& layout, std::span<const std::uint8_t> exposures);

  /// Pixel `first` of row y (times scale_of_floats()) where the bracket is a single float frame; otherwise null.
  [[nodiscard]] const std::byte* floats(int lens, int y, int first) const;
  [[nodiscard]] float scale_of_floats() const { return exposures_[0].radiance_per_linear; }

  /// Reads pixels [first, end) of row y of a lens into elements [0, end - first) of `out`. Exposures are merged with
  /// weights of the inverse variance of radiance (read noise, shot noise, rounding; Hasinoff et al. 2010,
  /// "Noise-optimal capture for high dynamic range photography"); saturated values have weight 0.
  void read(int lens, int y, int first, int end, Reading what, LinearRow& out, ReadStatistics& counts);

 private:
  /// Lookup tables by code, for one bit depth.
  struct CodeTable {
    std::vector<float> linear;
    std::vector<float> step;  ///< Difference to the next lower value, for the variance of rounding.
    unsigned saturated_from = 0;

    CodeTable(const PhotometricCalibration& photometry, int levels);
  };

  RowReader(const RigParameters& rig, const RigTable* table);
  /// What load() fills besides the linear values: nothing; steps and saturation; or these, with pixels that share their
  /// chroma with a saturated pixel counted as saturated, because their colour is wrong.
  enum class SaturationHandling { none, own, shared };
  void load(const View& view, int y, int first, int end, SaturationHandling saturation);
  /// 1 / relative illumination of pixels [first, end) of row y.
  [[nodiscard]] const float* inverse_vignetting_of(std::size_t lens, int y, int first, int end);

  const RigParameters& rig_;
  const RigTable* table_;                          ///< Null: `vignetting_` is used.
  std::vector<PixelVignetting> vignetting_;        ///< By lens; empty with a table.
  std::vector<std::vector<CodeTable>> tables_;     ///< By lens and index in kCodeBits.
  std::array<Exposure, kMaxBracket> exposures_{};  ///< Shortest first.
  std::size_t exposure_count_ = 0;
  const BlockLayout* layout_ = nullptr;  ///< Null: all exposures are used everywhere.
  std::span<const std::uint8_t> exposures_per_block_;
  unsigned present_lenses_ = 0;  ///< Bit mask.
  // Of one exposure: linear values, 0 to 1, quantization steps and saturation.
  std::vector<float> x_[3], step_;
  std::vector<std::uint8_t> saturated_;
  std::vector<float> weight_, ones_;
};

}  // namespace lightwell::estimate
