// Partition of a rig's images into square blocks.
#pragma once

#include <cstddef>
#include <vector>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/cells.hpp"

namespace lightwell::estimate {

/// Blocks of all lenses of a rig, numbered consecutively. Block k is cell k of the grid.
class BlockLayout {
 public:
  /// Blocks of `edge` x `edge` pixels, a power of two; the last of a row or column may be smaller.
  BlockLayout(const RigTable& table, int edge);

  struct Place {
    int lens = 0, x = 0, y = 0, width = 0, height = 0;  ///< In pixels.
  };
  [[nodiscard]] const Place& place(std::size_t block) const { return places_[block]; }
  [[nodiscard]] std::size_t block_of(int lens, int x, int y) const {
    const Lens& l = lenses_[static_cast<std::size_t>(lens)];
    return l.first + static_cast<std::size_t>(y >> shift_) * static_cast<std::size_t>(l.columns) +
           static_cast<std::size_t>(x >> shift_);
  }
  [[nodiscard]] std::size_t size() const { return total_; }
  [[nodiscard]] int edge() const { return edge_; }
  [[nodiscard]] int shift() const { return shift_; }  ///< edge() is 1 << shift().
  [[nodiscard]] int columns(int lens) const { return lenses_[static_cast<std::size_t>(lens)].columns; }
  [[nodiscard]] std::size_t first(int lens) const { return lenses_[static_cast<std::size_t>(lens)].first; }
  [[nodiscard]] int lens_count() const { return static_cast<int>(lenses_.size()); }

  /// Middle of the block's solid angle, in pixels from the block's corner.
  struct Middle {
    float x = 0, y = 0;
  };
  [[nodiscard]] Middle middle(std::size_t block) const { return middles_[block]; }
  /// Mean solid angle of the block's pixels that have one, sr.
  [[nodiscard]] float pixel_sr(std::size_t block) const { return pixel_sr_[block]; }

  /// Calls visit(x, y, index) for each pixel in rows: its place in the block, and its index in the lens's tables.
  template <class Visit>
  static void for_each_pixel(const Place& p, const LensTable& lens, Visit&& visit) {
    for (int y = 0; y < p.height; ++y)
      for (int x = 0; x < p.width; ++x) visit(x, y, lens.index(p.x + x, p.y + y));
  }

  /// The grid whose cells are these blocks.
  [[nodiscard]] CellGrid make_grid(const RigTable& table) const;

 private:
  struct Lens {
    int width, height, columns, rows;
    std::size_t first;
  };
  std::vector<Lens> lenses_;
  std::vector<Place> places_;
  std::vector<Middle> middles_;
  std::vector<float> pixel_sr_;
  int edge_, shift_;
  std::size_t total_ = 0;
};

}  // namespace lightwell::estimate
