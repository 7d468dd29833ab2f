// Radiance over directions, as every estimator hands it on: sums over small cells that tile what is seen.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/harmonics.hpp>

namespace lightwell::estimate {

/// Bands whose cosine lobe is not zero but which no descriptor sends: they tell what truncation leaves out.
inline constexpr std::array kTailBands = {8, 10, 12};
inline constexpr int kTailCount = 17 + 21 + 25;
inline constexpr int kRowCount = sh_count(kMaxBand) + kTailCount;

/// Values at one direction of the functions of bands 0 to 6 in their usual order, then of bands 8, 10 and 12.
using BasisRow = std::array<float, kRowCount>;
[[nodiscard]] BasisRow basis_row(Vec3d direction);

/// Light that came through one cell: the integral of radiance over its solid angle, W/m²-like per channel.
struct CellSum {
  float r = 0, g = 0, b = 0;

  [[nodiscard]] float luminance() const { return luminance_of(r, g, b); }
};

/// Coefficients of three channels in the order of a BasisRow.
struct Projection {
  std::array<std::array<double, 3>, kRowCount> c{};
};

/// The cells of a rig, worked out once, and projection onto harmonics.
class CellGrid {
 public:
  /// A cell's pixels: directions and solid angles. Cells without solid angle are kept as empty ones.
  struct Pixel {
    Vec3f direction;
    float solid_angle;
  };
  void reserve(std::size_t cells);
  void add_cell(std::span<const Pixel> pixels);
  /// After the last cell. Where the cells cover the whole sphere, projection is made the least-squares fit of bands 0
  /// to 6, so that what has no higher band comes out exactly, whatever the tiling; elsewhere (and where the cells are
  /// too few to tell the functions apart) it stays the plain sum with darkness where nothing was seen.
  void finish();

  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  [[nodiscard]] double covered_sr() const { return covered_; }
  [[nodiscard]] bool whole_sphere() const { return whole_sphere_; }
  /// How far sums over these cells are from integrals over the sphere, for products of two functions of bands 0 to 6:
  /// the largest entry of Gram matrix less identity. Large where cells are few. 0 where the sphere is not whole.
  [[nodiscard]] double gram_deviation() const { return gram_deviation_; }
  /// Projection is the least-squares fit: the sphere is whole and there are enough cells to make it sound.
  [[nodiscard]] bool fitted() const { return !inverse_gram_.empty(); }
  [[nodiscard]] float solid_angle(std::size_t cell) const { return solid_angle_[cell]; }
  /// Unit; zero of a cell without solid angle.
  [[nodiscard]] Vec3f direction(std::size_t cell) const { return direction_[cell]; }

  /// `sums` has size() entries. A cell in `moved`, by ascending cell, is taken at its own centroid instead of as spread
  /// evenly over the cell: light that sits in a corner.
  struct CentroidOverride {
    std::size_t cell;
    Vec3d centroid;
  };
  void project(std::span<const CellSum> sums, std::span<const CentroidOverride> moved, Projection& out) const;

 private:
  std::vector<BasisRow> rows_;  ///< Mean of the functions over each cell, weighted by solid angle.
  std::vector<float> solid_angle_;
  std::vector<Vec3f> direction_;
  std::vector<double> inverse_gram_;  ///< sh_count(kMaxBand) squared, row by row.
  double covered_ = 0;
  bool whole_sphere_ = false;
  double gram_deviation_ = 0;
};

/// A rig counts as seeing the whole sphere from this share on: the rest is a few pixels at the rim.
inline constexpr double kFullCoverage = 0.995;
/// Up to this gram_deviation the fit is sound: its condition number stays below 49 times that of the identity.
inline constexpr double kMaxGramDeviation = 0.02;

}  // namespace lightwell::estimate
