#include "estimate/panorama/block_flood_fill.hpp"

namespace lightwell::estimate {

BlockFloodFill::BlockFloodFill(const RigTable& table, const BlockLayout& layout, const CellGrid& grid, const BlockSums& sums,
                       const BrightPixels& pixels)
    : grid_(grid), sums_(sums), mark_(layout.size()) {
  blocks_.reserve(kMaxBlocks + 1);
  std::vector<std::uint32_t> found;
  for (std::size_t block = 0; block < layout.size(); ++block) {
    first_.push_back(static_cast<std::uint32_t>(beside_.size()));
    const BlockLayout::Place p = layout.place(block);
    const LensTable& lens = table.lenses[static_cast<std::size_t>(p.lens)];
    found.clear();
    for (int y = p.y; y < p.y + p.height; ++y) {
      for (int x = p.x; x < p.x + p.width; ++x) {
        const bool rim = x == p.x || y == p.y || x == p.x + p.width - 1 || y == p.y + p.height - 1;
        const std::size_t i =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(lens.width) + static_cast<std::size_t>(x);
        if (!rim && (lens.twin.empty() || lens.twin[i] < 0)) continue;
        pixels.for_each_neighbour({p.lens, x, y}, [&](BrightPixels::Place n, BrightPixels::Id) {
          const auto other = static_cast<std::uint32_t>(layout.block_of(n.lens, n.x, n.y));
          // Those that no lens sees hold no light and tell nothing of what is beside one.
          if (other != block && grid.solid_angle(other) > 0 &&
              std::find(found.begin(), found.end(), other) == found.end())
            found.push_back(other);
        });
      }
    }
    beside_.insert(beside_.end(), found.begin(), found.end());
  }
  first_.push_back(static_cast<std::uint32_t>(beside_.size()));
}

}  // namespace lightwell::estimate
