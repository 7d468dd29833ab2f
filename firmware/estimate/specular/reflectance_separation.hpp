// Separates the radiance of a plane into a diffuse part by texel and a specular part by viewing direction:
// L(x, v) = D(x) + S(v) (Jachnik et al. 2012, sections 5 and 7).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimate/specular/lumisphere.hpp"
#include "estimate/specular/running_median.hpp"
#include "estimate/specular/surface_light_field.hpp"

namespace lightwell::specular {

/// Steps of ReflectanceSeparation::sharpen(): more amplify noise, fewer leave blur.
inline constexpr int kSharpenSteps = 3;

/// Alternating robust least squares over all samples of a surface light field (the two-way additive model; backfitting,
/// Friedman & Stuetzle 1981): D(x) is a biweight mean over directions of L - S, in which near and near-normal
/// views, whose pixels are smallest, have more weight; S(v) is a weighted mean over texels of L - D. It starts from
/// running medians as D. A constant can move between D and S: S is 0 at its 2 % quantile. Reuses its memory.
class ReflectanceSeparation {
 public:
  /// `levels` of the lumisphere's hemisphere. It may be finer than that of the light field: the position of the lens is
  /// known for each page.
  ReflectanceSeparation(const PlaneTexels& texels, int levels);

  /// Adds the texels `first` (the first samples in their directions) of a frame to the running medians.
  void add_to_medians(const TexelImage& image, std::span<const std::uint32_t> first);

  /// Notes saturated texels of a frame: where most texels in a direction are saturated, S is the 90 % quantile of the
  /// lower bounds that they give (the darkest texels give the highest ones; some are wrong, at edges of the texture).
  void add_clipped(const TexelImage& image, Vec3d lens);

  /// Processes the next tiles until they have `samples` samples or a sweep ends; then S is replaced. A sweep passes all
  /// tiles, or a part of them where there are many samples: another part in every sweep. Returns whether it ended.
  bool sweep(const SurfaceLightField& light_field, std::size_t samples);
  /// Sweeps over all tiles, each with all samples.
  void solve(const SurfaceLightField& light_field, int sweeps);

  /// The light has changed: D is `gain` times that of before until there are samples, S is not known.
  void restart(float gain);

  /// Expected radiance of all texels from a position of the lens (plane frame, m); unseen where a texel has no value.
  void predict(Vec3d lens, TexelImage& out) const;

  /// D without the blur by the pixels' footprints: Van Cittert's deconvolution (van Cittert 1931) with a Gaussian whose
  /// variance at each texel is the mean over its samples.
  void sharpen(int iterations, TexelImage& out) const;

  /// D by texel, in the units of the samples; `clipped` is 0 where it is known, otherwise kUnseen.
  [[nodiscard]] const TexelImage& diffuse() const { return diffuse_; }
  [[nodiscard]] const Lumisphere& specular() const { return specular_; }
  [[nodiscard]] std::span<const RunningMedian> medians() const { return medians_; }
  /// Ended sweeps.
  [[nodiscard]] int sweeps() const { return sweeps_; }

 private:
  struct Sample {
    Radiance radiance;
    HemisphereGrid::Interpolation where;
    std::uint32_t k;  ///< Texel of the tile.
    float weight;     ///< In D: the squared number of pixels per area of the plane, up to a factor.
    float blur;       ///< Variance of a pixel's footprint along an axis, mean of both axes, texels².
  };
  bool process(const SurfaceLightField& light_field, std::size_t samples);
  void gather(const SurfaceLightField& light_field, int tile);
  void update_tile(int tile);
  void finish_sweep();
  /// The 2 % quantile of next_ over nodes with enough samples.
  [[nodiscard]] float low_quantile(float Radiance::*channel);

  PlaneTexels texels_;
  std::vector<RunningMedian> medians_;
  TexelImage diffuse_;
  std::vector<float> blur_;  ///< By texel: variance along an axis, texels².
  Lumisphere specular_, next_;
  struct ClippedNode {
    float bound = 0;                  ///< Luminance: running quantile of a saturated texel's radiance minus its D.
    Radiance color;                   ///< Mean of the same, for the hue.
    float clipped = 0, measured = 0;  ///< Texels.
  };
  std::vector<ClippedNode> clipped_;  ///< By node of the lumisphere.
  std::vector<Sample> samples_;
  std::vector<float> of_nodes_;  ///< Memory of low_quantile().
  int next_group_ = 0;           ///< Of stride_ tiles.
  int stride_ = 1, phase_ = 0;   ///< Every sweep passes one of stride_ tiles.
  int sweeps_ = 0;
};

}  // namespace lightwell::specular
