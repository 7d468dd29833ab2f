#include "estimate/common/cells.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include <lightwell/lobes.hpp>

namespace lightwell::estimate {
namespace {

constexpr int kCellCoefficients = sh_count(kMaxBand);
static_assert(kRowCount % 16 == 0 && sizeof(CellSum) == 3 * sizeof(float));

template <class Row>
void gather(const std::array<double, sh_count(kMaxBasisBand)>& all, Row& row) {
  using T = typename Row::value_type;
  std::size_t at = 0;
  for (; at < kCellCoefficients; ++at) row[at] = static_cast<T>(all[at]);
  for (const int l : kTailBands)
    for (int i = l * l; i < sh_count(l); ++i) row[at++] = static_cast<T>(all[static_cast<std::size_t>(i)]);
}

BandWeights compute_weights() {
  BandWeights out{};
  std::size_t at = 0;
  const auto put = [&](int l, double k2) {
    for (int m = -l; m <= l; ++m, ++at) {
      out.band[at] = l;
      out.irradiance[at] = static_cast<float>(cosine_lobe(l) * cosine_lobe(l) / kSphere);
      out.radiance[at] = static_cast<float>(k2 / kSphere);
    }
  };
  const GgxLobe lobe(BandWeights::kRoughness);
  const auto low = lobe.coefficients();
  for (int l = 0; l <= kMaxBand; ++l) put(l, low[static_cast<std::size_t>(l)] * low[static_cast<std::size_t>(l)]);
  double counted = 0, above = 0;
  for (const int l : kTailBands) {
    // K_l by its definition: the integral of lobe times P_l. An odd band is assumed as strong as the next even one.
    const auto k = [&](int band) {
      return 2 * std::numbers::pi *
             lobe.integral(0, 1, [&](double x) { return std::legendre(static_cast<unsigned>(band), x); });
    };
    const double even = k(l), odd = k(l - 1);
    put(l, even * even + odd * odd * (2 * l - 1) / (2 * l + 1));
    counted += (2 * l + 1) * cosine_lobe(l) * cosine_lobe(l);
  }
  for (int l = kTailBands.back() + 2; l <= 400; l += 2) above += (2 * l + 1) * cosine_lobe(l) * cosine_lobe(l);
  out.above_irradiance = above / counted;
  return out;
}

}  // namespace

BasisRow basis_row(Vec3d direction) {
  std::array<double, sh_count(kMaxBasisBand)> all;
  sh_basis(kTailBands.back(), direction, all);
  BasisRow row;
  gather(all, row);
  return row;
}

void CellGrid::reserve(std::size_t cells) {
  rows_.reserve(cells);
  solid_angle_.reserve(cells);
  direction_.reserve(cells);
}

void CellGrid::add_cell(std::span<const Pixel> pixels) {
  std::array<double, kRowCount> mean{};
  std::array<double, sh_count(kMaxBasisBand)> all;
  std::array<double, kRowCount> row;
  double total = 0;
  Vec3d toward;
  for (const Pixel& p : pixels) {
    if (!(p.solid_angle > 0)) continue;
    sh_basis(kTailBands.back(), vec_cast<double>(p.direction), all);
    gather(all, row);
    total += p.solid_angle;
    toward += vec_cast<double>(p.direction) * static_cast<double>(p.solid_angle);
    for (std::size_t i = 0; i < kRowCount; ++i) mean[i] += p.solid_angle * row[i];
  }
  BasisRow out{};
  if (total > 0)
    for (std::size_t i = 0; i < kRowCount; ++i) out[i] = static_cast<float>(mean[i] / total);
  rows_.push_back(out);
  solid_angle_.push_back(static_cast<float>(total));
  direction_.push_back(vec_cast<float>(normalized(toward)));
  covered_ += total;
}

void CellGrid::finish() {
  whole_sphere_ = covered_ > kFullCoverage * 4 * std::numbers::pi;
  if (!whole_sphere_) return;
  using Matrix = Eigen::Matrix<double, kCellCoefficients, kCellCoefficients, Eigen::RowMajor>;
  Matrix gram = Matrix::Zero();
  for (std::size_t cell = 0; cell < rows_.size(); ++cell) {
    const Eigen::Map<const Eigen::Matrix<float, kCellCoefficients, 1>> row(rows_[cell].data());
    const Eigen::Matrix<double, kCellCoefficients, 1> y = row.cast<double>();
    gram.selfadjointView<Eigen::Lower>().rankUpdate(y, solid_angle_[cell]);
  }
  const Matrix full = gram.selfadjointView<Eigen::Lower>();
  gram_deviation_ = (full - Matrix::Identity()).cwiseAbs().maxCoeff();
  if (!(gram_deviation_ < kMaxGramDeviation)) return;
  const Matrix inverse = full.ldlt().solve(Matrix::Identity());
  inverse_gram_.assign(inverse.data(), inverse.data() + kCellCoefficients * kCellCoefficients);
}

void CellGrid::project(std::span<const CellSum> sums, std::span<const CentroidOverride> overrides,
                       Projection& out) const {
  Totals total{};
  const auto add_to_total = [&total](const PartialTotals& partial) {
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t i = 0; i < kRowCount; ++i) total[k][i] += static_cast<double>(partial.c[k][i]);
  };
  auto next = overrides.begin();
  for (std::size_t begin = 0; begin < sums.size(); begin += kMaxCellsInFloat) {
    const std::size_t end = std::min(begin + kMaxCellsInFloat, sums.size());
    const auto first = next;
    while (next != overrides.end() && next->cell < end) ++next;
    PartialTotals partial;
    add_even(begin, end, sums, {first, next}, partial);
    add_to_total(partial);
  }
  for (std::size_t begin = 0; begin < overrides.size(); begin += kMaxCellsInFloat) {
    PartialTotals partial;
    add_centroids(sums, overrides.subspan(begin, std::min(kMaxCellsInFloat, overrides.size() - begin)), partial);
    add_to_total(partial);
  }
  fit(total, out);
}

void CellGrid::add(std::size_t begin, std::size_t end, std::span<const CellSum> sums,
                   std::span<const CentroidOverride> overrides, PartialTotals& out) const {
  add_even(begin, end, sums, overrides, out);
  if (!overrides.empty()) add_centroids(sums, overrides, out);
}

void CellGrid::add_even(std::size_t begin, std::size_t end, std::span<const CellSum> sums,
                        std::span<const CentroidOverride> overrides, PartialTotals& out) const {
  const float* const rows = rows_[begin].data();
  if (overrides.empty()) return add_weighted_rows(rows, &sums[begin].r, end - begin, out.c);
  CellSum without_overrides[kMaxCellsInFloat];
  std::copy_n(&sums[begin], end - begin, without_overrides);
  for (const CentroidOverride& o : overrides) without_overrides[o.cell - begin] = {};
  add_weighted_rows(rows, &without_overrides->r, end - begin, out.c);
}

void CellGrid::add_centroids(std::span<const CellSum> sums, std::span<const CentroidOverride> overrides,
                             PartialTotals& out) {
  LightPoints points;
  for (std::size_t begin = 0; begin < overrides.size(); begin += LightPoints::kMaxPoints) {
    points.count = std::min(LightPoints::kMaxPoints, overrides.size() - begin);
    for (std::size_t k = 0; k < points.count; ++k) {
      const CentroidOverride& o = overrides[begin + k];
      const CellSum& s = sums[o.cell];
      const Vec3f to = vec_cast<float>(o.centroid);
      points.x[k] = to.x, points.y[k] = to.y, points.z[k] = to.z;
      points.r[k] = s.r, points.g[k] = s.g, points.b[k] = s.b;
    }
    add_points(points, out.c);
  }
}

void CellGrid::fit(const Totals& total, Projection& out) const {
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) out.c[i][k] = total[k][i];
  if (!fitted()) return;
  for (std::size_t i = 0; i < kCellCoefficients; ++i) {
    double fit[3] = {};
    for (std::size_t j = 0; j < kCellCoefficients; ++j)
      for (std::size_t k = 0; k < 3; ++k) fit[k] += inverse_gram_[i * kCellCoefficients + j] * total[k][j];
    for (std::size_t k = 0; k < 3; ++k) out.c[i][k] = fit[k];
  }
}

const BandWeights& band_weights() {
  static const BandWeights weights = compute_weights();
  return weights;
}

IrradianceRms rms(const double (&squares)[3]) {
  return {std::sqrt((squares[0] + squares[1] + squares[2]) / 3),
          std::sqrt(luminance_of(squares[0], squares[1], squares[2]))};
}

double relative(const IrradianceRms& error, const IrradianceRms& whole) {
  const auto ratio = [](double e, double w) {
    if (e == 0) return 0.0;
    return w > 0 ? e / w : std::numeric_limits<double>::infinity();
  };
  return std::max(ratio(error.plain, whole.plain), ratio(error.weighted, whole.weighted));
}

IrradianceRms irradiance_rms(const Projection& scene) {
  const BandWeights& w = band_weights();
  double squares[3] = {};
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) squares[k] += w.irradiance[i] * scene.c[i][k] * scene.c[i][k];
  return rms(squares);
}

}  // namespace lightwell::estimate
