#include "estimate/specular/light_change.hpp"

#include <algorithm>
#include <cmath>

#include <lightwell/quantile.hpp>

namespace lightwell::specular {
namespace {

constexpr int kMaxCells = 16;
/// Pairs of neighbouring cells that are needed, of 480.
constexpr int kMinPairs = 60;
/// RMS difference of neighbouring cells, relative to their mean, that is needed: less is noise.
constexpr double kMinPatternContrast = 0.03;
/// Frames of rendered sequences have 0.96 and more, with half of the light 0.9; with a hand 0.5 to 0.7.
constexpr double kMinCorrelation = 0.85;
/// Length of a pixel on the plane, in cells: the poses of more grazing views are off by more.
constexpr double kLongestPixel = 1.0 / 3;
constexpr float kUnknown = -1;

}  // namespace

LightChange::LightChange(const PlaneTexels& texels)
    : texels_(texels),
      cells_(std::min(kMaxCells, texels.tiles())),
      of_image_(static_cast<std::size_t>(cells_ * cells_)),
      of_diffuse_(of_image_.size()) {
  gains_.reserve(kFrames);
}

std::optional<LightChange::Contrast> LightChange::contrast_of(const TexelImage& image, const TexelImage& diffuse) {
  const auto edge_of = [&](int cell) { return cell * texels_.edge / cells_; };
  for (int row = 0; row < cells_; ++row)
    for (int column = 0; column < cells_; ++column) {
      float of_image = 0, of_diffuse = 0, count = 0;
      bool known = true;
      for (int y = edge_of(row); y < edge_of(row + 1); ++y)
        for (int x = edge_of(column); x < edge_of(column + 1); ++x) {
          const auto at = static_cast<std::size_t>(y * texels_.edge + x);
          known = known && image[at].measured() && diffuse[at].seen();
          of_image += image[at].luminance(), of_diffuse += diffuse[at].luminance();
          ++count;
        }
      const auto cell = static_cast<std::size_t>(row * cells_ + column);
      of_image_[cell] = known ? of_image / count : kUnknown;
      of_diffuse_[cell] = known ? of_diffuse / count : kUnknown;
    }
  double squares = 0, squares_of_image = 0, products = 0, sum = 0;
  int pairs = 0;
  const auto add_pair = [&](int from, int to) {
    const auto a = static_cast<std::size_t>(from), b = static_cast<std::size_t>(to);
    if (of_diffuse_[a] == kUnknown || of_diffuse_[b] == kUnknown) return;
    const auto i = static_cast<double>(of_image_[b] - of_image_[a]);
    const auto d = static_cast<double>(of_diffuse_[b] - of_diffuse_[a]);
    squares += d * d, squares_of_image += i * i, products += i * d;
    sum += static_cast<double>(of_diffuse_[a] + of_diffuse_[b]) / 2;
    ++pairs;
  };
  for (int row = 0; row < cells_; ++row)
    for (int column = 0; column < cells_; ++column) {
      if (column + 1 < cells_) add_pair(row * cells_ + column, row * cells_ + column + 1);
      if (row + 1 < cells_) add_pair(row * cells_ + column, (row + 1) * cells_ + column);
    }
  const double mean = sum / std::max(pairs, 1);
  if (pairs < kMinPairs || !(squares > pairs * std::pow(kMinPatternContrast * mean, 2)) || !(squares_of_image > 0))
    return std::nullopt;
  return Contrast{products / squares, products / std::sqrt(squares * squares_of_image)};
}

std::optional<LightChange::Change> LightChange::add(const TexelImage& image, const ViewPoint& from,
                                                    const TexelImage& diffuse, std::uint32_t frame) {
  // A pixel is pixel_rad times the distance wide, and longer by 1 / cosine.
  const double pixel_m = from.pixel_rad * dot(from.lens, from.lens) / from.lens.z;
  if (!(from.lens.z > 0) || !(pixel_m < kLongestPixel * texels_.size_m / cells_)) return std::nullopt;
  const std::optional<Contrast> contrast = contrast_of(image, diffuse);
  if (!contrast || !(contrast->correlation > kMinCorrelation)) return std::nullopt;
  const double gain = std::log(contrast->gain);
  const bool other_way = !gains_.empty() && (gain > 0) != (gains_.back() > 1);
  if (std::abs(gain) < kMinChange || other_way) gains_.clear(), since_.reset();
  if (std::abs(gain) < kMinChange) return std::nullopt;
  if (!since_) since_ = frame;
  gains_.push_back(contrast->gain);
  if (gains_.size() < static_cast<std::size_t>(kFrames)) return std::nullopt;
  const Change out{*since_, median(gains_)};
  gains_.clear(), since_.reset();
  return out;
}

}  // namespace lightwell::specular
