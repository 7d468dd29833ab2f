#include "estimate/specular/light_change.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <lightwell/quantile.hpp>

namespace lightwell::specular {
namespace {

constexpr int kMaxCells = 16;
/// Cells with four neighbours that are needed, of 196.
constexpr int kMinCells = 40;
/// RMS detail (a cell minus the mean of its neighbours), relative to the mean, that is needed: less is noise.
constexpr double kMinPatternContrast = 0.03;
/// Frames of rendered sequences have 0.98 and more, also with half of the light; with a hand 0.5 to 0.7; with an
/// unsaturated highlight that is ten times as bright as the plane, and as narrow as three cells, 0.85 to 0.97.
constexpr double kMinCorrelation = 0.97;
/// Length of a pixel on the plane, in cells: the poses of more grazing views are off by more.
constexpr double kLongestPixel = 1.0 / 3;
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

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
  int count = 0;
  const auto width = static_cast<std::size_t>(cells_);
  for (std::size_t row = 1; row + 1 < width; ++row)
    for (std::size_t at = row * width + 1; at + 1 < (row + 1) * width; ++at) {
      const auto i = static_cast<double>(detail_at(of_image_, width, at));
      const auto d = static_cast<double>(detail_at(of_diffuse_, width, at));
      if (std::isnan(i) || std::isnan(d)) continue;
      squares += d * d, squares_of_image += i * i, products += i * d;
      sum += static_cast<double>(of_diffuse_[at]);
      ++count;
    }
  const double mean = sum / std::max(count, 1);
  if (count < kMinCells || !(squares > count * std::pow(kMinPatternContrast * mean, 2)) || !(squares_of_image > 0))
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
