// Weights of the GGX lobe (Walter et al. 2007) over an octahedral map, for the levels of a prefiltered map.
#pragma once

#include <vector>

#include <lightwell/lobes.hpp>

#include "estimate/common/octahedral_grid.hpp"
#include "estimate/common/sparse_rows.hpp"

namespace lightwell::estimate {

/// A mip pyramid of an octahedral map: means over 2x2, 4x4, ... texels, down to 4x4 texels, all layers in one array.
class MeanPyramid {
 public:
  static constexpr int kMinEdge = 4;
  explicit MeanPyramid(const OctahedralGrid& grid);

  struct Layer {
    int edge;
    std::size_t first;  ///< Index of its first texel in the array.
    SparseRows means;   ///< From the previous layer; empty for the map itself.
  };
  [[nodiscard]] const std::vector<Layer>& layers() const { return layers_; }
  [[nodiscard]] std::size_t size() const;
  /// Computes all layers from the map, which is at the start of the array.
  void apply(std::span<Rgbx> list) const;

 private:
  std::vector<Layer> layers_;
};

/// Rows that convert a pyramid to the texels of a level: radiance(d, r) at the centre of each texel (lobes.hpp). Near
/// the middle of the lobe, rows use single texels, farther out, where the lobe is flat, texels of coarser layers.
/// Weights are the lobe's integral over the samples of each texel; they sum to 1.
[[nodiscard]] SparseRows lobe_rows(const OctahedralGrid& grid, const MeanPyramid& pyramid, int edge, double roughness);

}  // namespace lightwell::estimate
