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
  for (const Place& p : places_) {
    const LensTable& lens = table.lenses[static_cast<std::size_t>(p.lens)];
    double sr = 0, sum_x = 0, sum_y = 0;
    float sum = 0, pixels = 0;
    for_each_pixel(p, lens, [&](int x, int y, std::size_t i) {
      const float a = lens.solid_angle[i];
      sr += a;
      sum_x += static_cast<double>(a) * x;
      sum_y += static_cast<double>(a) * y;
      sum += a;
      pixels += a > 0 ? 1.0F : 0.0F;
    });
    middles_.push_back(sr > 0 ? Middle{static_cast<float>(sum_x / sr), static_cast<float>(sum_y / sr)} : Middle{});
    pixel_sr_.push_back(pixels > 0 ? sum / pixels : 0);
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
    for_each_pixel(p, lens, [&](int, int, std::size_t i) {
      if (lens.solid_angle[i] > 0) pixels.push_back({lens.direction[i], lens.solid_angle[i]});
    });
    grid.add_cell(pixels);
  }
  grid.finish();
  return grid;
}

}  // namespace lightwell::estimate
