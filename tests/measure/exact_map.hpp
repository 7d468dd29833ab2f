// An octahedral map (proto/README.md, "The environment map") whose texels are exact means of a panorama over their
// solid angles, lights included, in double: the best that a map of that size can be.
#pragma once

#include <cstddef>
#include <vector>

#include "reference/panorama.hpp"

namespace lightwell::measure {

class ExactMap {
 public:
  /// `edge`: texels along an edge of the square. `panorama` must be cleaned.
  ExactMap(const reference::Panorama& panorama, int edge);

  /// Interpolated bilinearly between the centres of texels, across the edges of the square, too.
  [[nodiscard]] reference::Rgb radiance(const reference::V3& unit_direction) const;

 private:
  [[nodiscard]] std::size_t index(int column, int row) const;

  int edge_;
  std::vector<reference::Rgb> texels_;
};

}  // namespace lightwell::measure
