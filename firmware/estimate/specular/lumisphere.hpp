// The radiance that a plane of one material reflects specularly, by viewing direction: one lumisphere for all texels
// (Jachnik et al. 2012, section 7, "global specular lumisphere").
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/hemisphere_grid.hpp>

namespace lightwell::specular {

/// Values at the nodes of a hemisphere, linear between them.
struct Lumisphere {
  HemisphereGrid grid{120};
  std::vector<Radiance> value;  ///< By node.
  std::vector<float> weight;    ///< By node: sum of the weights of the samples around it; 0: never seen.
  /// By node: standard deviation of the luminance of the samples around it: blur at edges of the texture, wrong poses.
  std::vector<float> sigma;
  /// By node: 1 where most samples were saturated; the value is a lower bound. Where the weight is 0: fill_unseen().
  std::vector<std::uint8_t> clipped;

  explicit Lumisphere(int levels = 120)
      : grid(levels), value(grid.size()), weight(grid.size()), sigma(grid.size()), clipped(grid.size()) {}

  [[nodiscard]] Radiance at(const HemisphereGrid::Interpolation& where) const {
    Radiance out;
    for (std::size_t k = 0; k < 3; ++k) out += where.weight[k] * value[where.node[k]];
    return out;
  }
  /// `to_viewer`: plane frame, need not be normalised.
  [[nodiscard]] Radiance at(Vec3f to_viewer) const { return at(grid.interpolate(to_viewer)); }
};

/// Gives nodes that were never seen a value from their neighbours, from the seen ones outwards: as if the light that
/// they mirror were the neighbours' mean, with Schlick's Fresnel term of a refractive index of 1.5, which rises at
/// grazing angles; `clipped` where most of them are. Nothing where no node was seen. Weights stay 0.
void fill_unseen(Lumisphere& lumisphere);

}  // namespace lightwell::specular
