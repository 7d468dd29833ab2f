#include <limits>

#include "estimate/common/cells.hpp"
#include "estimate/common/environment_updates.hpp"

namespace lightwell::estimate {
namespace {

/// In radii of the disc with a cell's solid angle: radius of the kernel, and the largest distance from a cell at which
/// a direction counts as observed (the corner of a tile twice as long as wide).
constexpr double kKernelReach = 2, kObservedReach = 1.4;
constexpr int kMaxSinkhornIterations = 200;
constexpr double kSinkhornTolerance = 1e-6;
/// Smallest observed share of a texel inside the observed region; texels at its boundary are below.
constexpr double kMinObservedShare = 0.999;

/// Squared chord length of an angle, to compare with squared distances of unit vectors.
float chord2(double angle) {
  const double c = 2 * std::sin(std::min(angle, std::numbers::pi) / 2);
  return static_cast<float>(c * c);
}

float distance2(Vec3f a, Vec3f b) { return dot(a - b, a - b); }

/// Uniform grid over the cube around the unit sphere, for range queries of samples.
class SampleGrid {
 public:
  explicit SampleGrid(std::span<const OctahedralGrid::Sample> samples) : begin_(kSide * kSide * kSide + 1) {
    for (const auto& s : samples) ++begin_[box_of(s.direction) + 1];
    for (std::size_t k = 1; k < begin_.size(); ++k) begin_[k] += begin_[k - 1];
    order_.resize(samples.size());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t k = 0; k < samples.size(); ++k)
      order_[next[box_of(samples[k].direction)]++] = static_cast<std::uint32_t>(k);
  }

  /// Calls f(sample) for at least all samples whose chord to `centre` is at most `reach`.
  template <class F>
  void around(Vec3f centre, float reach, F&& f) const {
    const auto range = [reach](float c) { return std::array{slot(c - reach), slot(c + reach)}; };
    const auto x = range(centre.x), y = range(centre.y), z = range(centre.z);
    for (std::size_t k = z[0]; k <= z[1]; ++k)
      for (std::size_t j = y[0]; j <= y[1]; ++j)
        for (std::size_t i = x[0]; i <= x[1]; ++i) {
          const std::size_t box = (k * kSide + j) * kSide + i;
          for (std::uint32_t at = begin_[box]; at < begin_[box + 1]; ++at) f(order_[at]);
        }
  }

 private:
  static constexpr std::size_t kSide = 32;
  static std::size_t slot(float c) {
    return static_cast<std::size_t>(std::clamp((c + 1) * (kSide / 2.0F), 0.0F, kSide - 1.0F));
  }
  static std::size_t box_of(Vec3f d) { return (slot(d.z) * kSide + slot(d.y)) * kSide + slot(d.x); }

  std::vector<std::uint32_t> begin_, order_;
};

/// Weight of a cell at a sample, later the solid angle that a cell and a texel share.
struct Overlap {
  std::uint32_t at, cell;
  double sr;
};

class Splat {
 public:
  Splat(std::span<const Vec3f> direction, std::span<const float> solid_angle, const OctahedralGrid& grid)
      : direction_(direction), solid_angle_(solid_angle), grid_(grid), sample_grid_(grid.sample) {
    for (std::size_t c = 0; c < size(); ++c)
      if (usable(c)) covered_ += solid_angle_[c];
    full_sphere_ = covered_ > kFullCoverage * 4 * std::numbers::pi;
  }

  SparseRows build() {
    evaluate_kernels();
    if (full_sphere_) close_gaps();
    gather_texels();
    sinkhorn_balance();
    return rows();
  }

 private:
  [[nodiscard]] std::size_t size() const { return std::min(direction_.size(), solid_angle_.size()); }
  [[nodiscard]] bool usable(std::size_t c) const {
    const float n = length(direction_[c]);
    return solid_angle_[c] > 0 && std::isfinite(solid_angle_[c]) && n > 0.9F && n < 1.1F;
  }

  /// Evaluates the kernel of every cell at the samples around it.
  void evaluate_kernels() {
    observed_.assign(grid_.sample.size(), 0);
    for (std::size_t c = 0; c < size(); ++c) {
      if (!usable(c)) continue;
      const double radius = std::acos(1 - std::min(2.0, solid_angle_[c] / (2 * std::numbers::pi)));
      const float reach2 = chord2(kKernelReach * radius), observed2 = chord2(kObservedReach * radius);
      sample_grid_.around(direction_[c], std::sqrt(reach2), [&](std::uint32_t s) {
        const float d2 = distance2(grid_.sample[s].direction, direction_[c]);
        if (d2 >= reach2) return;
        const double slope = 1 - static_cast<double>(d2) / reach2;
        kernel_values_.push_back({s, static_cast<std::uint32_t>(c), slope * slope});
        if (d2 <= observed2) observed_[s] = 1;
      });
    }
  }

  /// On a full sphere, samples that no kernel reaches are assigned to the nearest cells.
  void close_gaps() {
    std::vector<char> reached(observed_.size(), 0);
    for (const Overlap& m : kernel_values_) reached[m.at] = 1;
    for (std::size_t s = 0; s < observed_.size(); ++s) {
      observed_[s] = 1;
      if (reached[s] != 0) continue;
      const Vec3f d = grid_.sample[s].direction;
      float nearest2 = std::numeric_limits<float>::max();
      for (std::size_t c = 0; c < size(); ++c)
        if (usable(c)) nearest2 = std::min(nearest2, distance2(d, direction_[c]));
      const double reach2 = 4 * static_cast<double>(nearest2);
      for (std::size_t c = 0; c < size(); ++c) {
        if (!usable(c)) continue;
        const double slope = 1 - static_cast<double>(distance2(d, direction_[c])) / reach2;
        if (slope > 0)
          kernel_values_.push_back({static_cast<std::uint32_t>(s), static_cast<std::uint32_t>(c), slope * slope});
      }
    }
  }

  /// Divides each observed sample among its cells in proportion to their kernels, and sums by texel and cell.
  void gather_texels() {
    std::vector<double> sum(observed_.size(), 0);
    std::vector<char> assigned(size(), 0);
    observed_sr_.assign(grid_.texels(), 0);
    for (const Overlap& m : kernel_values_) sum[m.at] += m.sr;
    for (std::size_t s = 0; s < observed_.size(); ++s)
      if (observed_[s] != 0) observed_sr_[s / grid_.per_texel()] += grid_.sample[s].solid_angle;
    for (const Overlap& m : kernel_values_) {
      if (observed_[m.at] == 0) continue;
      overlaps_.push_back({static_cast<std::uint32_t>(m.at / grid_.per_texel()), m.cell,
                           m.sr / sum[m.at] * grid_.sample[m.at].solid_angle});
      assigned[m.cell] = 1;
    }
    kernel_values_.clear();
    // Cells that lie between samples go to the texel of their direction.
    for (std::size_t c = 0; c < size(); ++c)
      if (usable(c) && assigned[c] == 0)
        overlaps_.push_back({static_cast<std::uint32_t>(grid_.texel_of(direction_[c])), static_cast<std::uint32_t>(c),
                             solid_angle_[c]});
    std::sort(overlaps_.begin(), overlaps_.end(),
              [](const Overlap& a, const Overlap& b) { return a.at != b.at ? a.at < b.at : a.cell < b.cell; });
    std::size_t kept = 0;
    for (const Overlap& p : overlaps_)
      if (kept > 0 && overlaps_[kept - 1].at == p.at && overlaps_[kept - 1].cell == p.cell)
        overlaps_[kept - 1].sr += p.sr;
      else
        overlaps_[kept++] = p;
    overlaps_.resize(kept);
  }

  void sinkhorn_balance() {
    const double full = full_sphere_ ? 4 * std::numbers::pi / covered_ : 1;
    std::vector<double> of_texel(grid_.texels()), of_cell(size());
    for (int round = 0; round < kMaxSinkhornIterations; ++round) {
      // The last step balances texels on a full sphere (a constant stays exact), cells otherwise (no energy is lost).
      const bool texels = (round % 2 == 1) == full_sphere_;
      auto& sum = texels ? of_texel : of_cell;
      std::fill(sum.begin(), sum.end(), 0.0);
      for (const Overlap& p : overlaps_) sum[texels ? p.at : p.cell] += p.sr;
      double worst = 0;
      for (std::size_t k = 0; k < sum.size(); ++k) {
        if (!(sum[k] > 0)) continue;
        const double target = texels ? grid_.solid_angle[k] : full * solid_angle_[k];
        const bool unconstrained =
            texels && !full_sphere_ && observed_sr_[k] < kMinObservedShare * grid_.solid_angle[k];
        sum[k] = unconstrained ? 1 : target / sum[k];
        worst = std::max(worst, std::abs(sum[k] - 1));
      }
      for (Overlap& p : overlaps_) p.sr *= sum[texels ? p.at : p.cell];
      if (worst < kSinkhornTolerance && round % 2 == 1) return;
    }
  }

  [[nodiscard]] SparseRows rows() const {
    SparseRows out;
    std::vector<SparseRows::Entry> row;
    std::size_t at = 0;
    for (std::size_t texel = 0; texel < grid_.texels(); ++texel) {
      row.clear();
      for (; at < overlaps_.size() && overlaps_[at].at == texel; ++at) {
        const Overlap& p = overlaps_[at];
        row.push_back({p.cell, static_cast<float>(p.sr / (solid_angle_[p.cell] * grid_.solid_angle[texel]))});
      }
      out.add_row(row);
    }
    return out;
  }

  std::span<const Vec3f> direction_;
  std::span<const float> solid_angle_;
  const OctahedralGrid& grid_;
  SampleGrid sample_grid_;
  double covered_ = 0;
  bool full_sphere_ = false;
  std::vector<Overlap> kernel_values_, overlaps_;
  std::vector<char> observed_;
  std::vector<double> observed_sr_;  ///< Observed solid angle of each texel.
};

}  // namespace

SparseRows splat_rows(std::span<const Vec3f> direction, std::span<const float> solid_angle,
                      const OctahedralGrid& grid) {
  return Splat(direction, solid_angle, grid).build();
}

}  // namespace lightwell::estimate
