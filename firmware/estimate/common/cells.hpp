// Radiance over directions as sums over small cells that tile the observed part of the sphere, its projection onto
// spherical harmonics (SH), and the RMS over all normals of a projection by Parseval's theorem.
#pragma once

#include <array>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/harmonics.hpp>

namespace lightwell::estimate {

/// Solid angle of the whole sphere, sr.
inline constexpr double kSphere = 4 * std::numbers::pi;

/// Bands above those of a descriptor with a nonzero coefficient of the cosine lobe. They estimate the truncation error.
inline constexpr std::array kTailBands = {8, 10, 12};
inline constexpr int kTailCount = 17 + 21 + 25;
inline constexpr int kRowCount = sh_count(kMaxBand) + kTailCount;

/// SH basis functions at one direction: bands 0 to 6 in sh_index() order, then bands 8, 10 and 12.
using BasisRow = std::array<float, kRowCount>;
/// `direction`: unit vector, probe frame.
[[nodiscard]] BasisRow basis_row(Vec3d direction);

/// Integral of radiance over the solid angle of one cell (a vector irradiance), per channel.
struct CellSum {
  float r = 0, g = 0, b = 0;

  [[nodiscard]] float luminance() const { return luminance_of(r, g, b); }
  CellSum& operator+=(const CellSum& o) {
    r += o.r, g += o.g, b += o.b;
    return *this;
  }
  friend CellSum operator*(const CellSum& s, float k) { return {s.r * k, s.g * k, s.b * k}; }
};

/// SH coefficients of three channels, in the order of a BasisRow.
struct Projection {
  std::array<std::array<double, 3>, kRowCount> c{};
};

/// The cells of a rig, precomputed, and projection onto spherical harmonics.
class CellGrid {
 public:
  /// A pixel of a cell: unit direction and solid angle, sr. Cells without solid angle are kept as empty cells.
  struct Pixel {
    Vec3f direction;
    float solid_angle;
  };
  void reserve(std::size_t cells);
  void add_cell(std::span<const Pixel> pixels);
  /// Must be called after the last cell. Where fitted() is then true, projection is the least-squares fit of bands 0 to
  /// 6, otherwise the plain sum, in which unobserved directions are dark.
  void finish();

  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  /// Solid angle of all cells, sr.
  [[nodiscard]] double covered_sr() const { return covered_; }
  /// Whether the cells cover at least kFullCoverage of the sphere.
  [[nodiscard]] bool whole_sphere() const { return whole_sphere_; }
  /// Largest absolute entry of G - I, where G is the Gram matrix of bands 0 to 6 over the cells: the quadrature error
  /// of products of two basis functions. Large where cells are few. 0 where whole_sphere() is false.
  [[nodiscard]] double gram_deviation() const { return gram_deviation_; }
  /// Whether projection is the least-squares fit: whole_sphere(), and gram_deviation() below kMaxGramDeviation.
  [[nodiscard]] bool fitted() const { return !inverse_gram_.empty(); }
  [[nodiscard]] float solid_angle(std::size_t cell) const { return solid_angle_[cell]; }
  /// Mean direction, unit; zero for a cell without solid angle.
  [[nodiscard]] Vec3f direction(std::size_t cell) const { return direction_[cell]; }

  /// Projects `sums`, which has size() entries. The light of a cell in `overrides` (sorted by cell) is assumed to come
  /// from its centroid (unit vector) instead of evenly from the cell.
  struct CentroidOverride {
    std::size_t cell;
    Vec3d centroid;
  };
  void project(std::span<const CellSum> sums, std::span<const CentroidOverride> overrides, Projection& out) const;

  /// Sums over cells of light times basis function, by channel: the projection before the fit.
  using Totals = std::array<std::array<double, kRowCount>, 3>;
  /// The same of few cells. Rounding errors stay below 1e-6 of the largest coefficient of kMaxCellsInFloat cells.
  struct PartialTotals {
    float c[3][kRowCount] = {};
  };
  static constexpr std::size_t kMaxCellsInFloat = 256;
  /// Adds at most kMaxCellsInFloat cells, from `begin` to before `end`, to which all `overrides` belong. `sums`: of all
  /// cells.
  void add(std::size_t begin, std::size_t end, std::span<const CellSum> sums,
           std::span<const CentroidOverride> overrides, PartialTotals& out) const;
  /// The projection of the cells whose totals these are.
  void fit(const Totals& total, Projection& out) const;

 private:
  /// The two parts of add(): evenly lit cells, and those with a centroid.
  void add_even(std::size_t begin, std::size_t end, std::span<const CellSum> sums,
                std::span<const CentroidOverride> overrides, PartialTotals& out) const;
  static void add_centroids(std::span<const CellSum> sums, std::span<const CentroidOverride> overrides,
                            PartialTotals& out);

  std::vector<BasisRow> rows_;  ///< Mean of the basis functions over each cell, weighted by solid angle.
  std::vector<float> solid_angle_;
  std::vector<Vec3f> direction_;
  std::vector<double> inverse_gram_;  ///< sh_count(kMaxBand) squared, row-major.
  double covered_ = 0;
  bool whole_sphere_ = false;
  double gram_deviation_ = 0;
};

/// Smallest share of the sphere that counts as full coverage: the rest is a few pixels at the edge of the image circle.
inline constexpr double kFullCoverage = 0.995;
/// Largest gram_deviation() for the fit: all 49 eigenvalues are then between 0.02 and 1.98 (Gershgorin's theorem).
inline constexpr double kMaxGramDeviation = 0.02;

/// RMS over all normals: mean over the three channels, and weighted by luminance. Errors are measured both ways.
struct IrradianceRms {
  double plain = 0;     ///< Root of the mean square over normals and channels.
  double weighted = 0;  ///< Root of the mean over normals of the luminance-weighted sum of squares.
};

/// From the mean squares over normals of three channels.
[[nodiscard]] IrradianceRms rms(const double (&squares)[3]);

/// The larger of the two ratios error / whole; 0 for 0/0, infinite for an error without light.
[[nodiscard]] double relative(const IrradianceRms& error, const IrradianceRms& whole);

/// Of the irradiance by the bands of a projection (0 to 6, 8, 10 and 12).
[[nodiscard]] IrradianceRms irradiance_rms(const Projection& scene);

/// By basis function of a BasisRow: its band, and the weight of its squared coefficient in a mean over normals.
struct BandWeights {
  /// Roughness of the GGX lobe in which errors of glossy radiance are measured.
  static constexpr double kRoughness = 0.5;

  int band[kRowCount];
  float irradiance[kRowCount];  ///< A_l² / 4pi; A_l: coefficients of the cosine lobe.
  float radiance[kRowCount];    ///< K_l² / 4pi; K_l: of the GGX lobe. Bands 8, 10, 12 include 7, 9, 11.
  /// Mean square irradiance of bands above 12 relative to bands 8, 10, 12, for a point light (flattest spectrum).
  double above_irradiance = 0;
};
[[nodiscard]] const BandWeights& band_weights();

/// `rows`: `count` BasisRows. out[c][i] += sum over k of weights[3 k + c] * rows[k][i], in float; precise for a few
/// hundred rows.
void add_weighted_rows(const float* rows, const float* weights, std::size_t count, float (&out)[3][kRowCount]);

/// Point lights. Elements beyond `count` must be finite and are ignored.
struct LightPoints {
  static constexpr std::size_t kMaxPoints = 128;
  std::size_t count = 0;
  alignas(64) std::array<float, kMaxPoints> x{}, y{}, z{};  ///< Unit vectors.
  alignas(64) std::array<float, kMaxPoints> r{}, g{}, b{};
};

/// out[c][i] += sum over the points of channel c times basis function i of a BasisRow, in float. Error: at most 2e-6
/// of the largest basis function times the sum of absolute values.
void add_points(const LightPoints& points, float (&out)[3][kRowCount]);

}  // namespace lightwell::estimate
