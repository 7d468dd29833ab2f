#include "estimate/frames/block_layout.hpp"

#include <algorithm>
#include <bit>

namespace lightwell::estimate {

BlockLayout::BlockLayout(const RigTable& table, int edge)
    : edge_(edge), shift_(std::countr_zero(static_cast<unsigned>(edge))) {
  for (const LensTable& lens : table.lenses) {
    const Lens l{lens.width, lens.height, (lens.width + edge - 1) / edge, (lens.height + edge - 1) / edge, total_};
    total_ += static_cast<std::size_t>(l.columns) * static_cast<std::size_t>(l.rows);
    const auto number = static_cast<int>(lenses_.size());
    for (int y = 0; y < l.height; y += edge)
      for (int x = 0; x < l.width; x += edge)
        places_.push_back({number, x, y, std::min(edge, l.width - x), std::min(edge, l.height - y)});
    lenses_.push_back(l);
  }
}

CellGrid BlockLayout::make_grid(const RigTable& table) const {
  CellGrid grid;
  grid.reserve(total_);
  std::vector<CellGrid::Pixel> pixels;
  for (std::size_t block = 0; block < total_; ++block) {
    const Place p = place(block);
    const LensTable& lens = table.lenses[static_cast<std::size_t>(p.lens)];
    pixels.clear();
    for (int y = p.y; y < p.y + p.height; ++y) {
      for (int x = p.x; x < p.x + p.width; ++x) {
        const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(lens.width) + static_cast<std::size_t>(x);
        if (lens.solid_angle[i] > 0) pixels.push_back({lens.direction[i], lens.solid_angle[i]});
      }
    }
    grid.add_cell(pixels);
  }
  grid.finish();
  return grid;
}

}  // namespace lightwell::estimate
