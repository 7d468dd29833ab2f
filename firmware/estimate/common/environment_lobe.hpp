// The GGX lobe over an octahedral square: what each further level of a map is made of.
#pragma once

#include <vector>

#include <lightwell/lobes.hpp>

#include "estimate/common/octahedral_grid.hpp"
#include "estimate/common/sparse_rows.hpp"

namespace lightwell::estimate {

/// An octahedral square and its means over 2x2, 4x4, ... texels, down to 4x4 in all, one after another in one list.
class MeanPyramid {
 public:
  static constexpr int kMinEdge = 4;
  explicit MeanPyramid(const OctahedralGrid& grid);

  struct Layer {
    int edge;
    std::size_t first;  ///< In the list.
    SparseRows means;   ///< From the layer before; none for the square itself.
  };
  [[nodiscard]] const std::vector<Layer>& layers() const { return layers_; }
  [[nodiscard]] std::size_t size() const;
  /// Fills all but the square itself, which stands at the start.
  void apply(std::span<Rgbx> list) const;

 private:
  std::vector<Layer> layers_;
};

/// Rows that turn a pyramid's list into the texels of a level: radiance(d, r) at the centre of each (lobes.hpp). Near
/// the middle of the lobe single texels count, farther out means of ever more, as the lobe grows flat; weights are the
/// lobe's integral over the samples of each texel and sum to one.
[[nodiscard]] SparseRows lobe_rows(const OctahedralGrid& grid, const MeanPyramid& pyramid, int edge, double roughness);

}  // namespace lightwell::estimate
