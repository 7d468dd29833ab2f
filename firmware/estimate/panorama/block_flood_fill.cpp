#include "estimate/panorama/block_flood_fill.hpp"

namespace lightwell::estimate {

BlockFloodFill::BlockFloodFill(const RigTable& table, const BlockLayout& layout, const CellGrid& grid,
                               const BrightPixels& pixels)
    : grid_(grid), mark_(layout.size()) {
  blocks_.reserve(kMaxBlocks + 1);
  std::vector<std::uint32_t> neighbours;
  for (std::size_t block = 0; block < layout.size(); ++block) {
    first_neighbour_.push_back(static_cast<std::uint32_t>(neighbours_.size()));
    const BlockLayout::Place p = layout.place(block);
    const LensTable& lens = table.lenses[static_cast<std::size_t>(p.lens)];
    neighbours.clear();
    for (int y = p.y; y < p.y + p.height; ++y) {
      for (int x = p.x; x < p.x + p.width; ++x) {
        const bool rim = x == p.x || y == p.y || x == p.x + p.width - 1 || y == p.y + p.height - 1;
        const std::size_t i =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(lens.width) + static_cast<std::size_t>(x);
        if (!rim && (lens.overlap_pixel.empty() || lens.overlap_pixel[i] < 0)) continue;
        pixels.for_each_neighbour({p.lens, x, y}, [&](BrightPixels::Place n, BrightPixels::Id) {
          const auto other = static_cast<std::uint32_t>(layout.block_of(n.lens, n.x, n.y));
          // Blocks without solid angle contain no light and are no background.
          if (other != block && grid.solid_angle(other) > 0 &&
              std::find(neighbours.begin(), neighbours.end(), other) == neighbours.end())
            neighbours.push_back(other);
        });
      }
    }
    neighbours_.insert(neighbours_.end(), neighbours.begin(), neighbours.end());
  }
  first_neighbour_.push_back(static_cast<std::uint32_t>(neighbours_.size()));
}

}  // namespace lightwell::estimate
