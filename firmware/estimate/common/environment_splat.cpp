#include "estimate/common/environment_splat.hpp"

#include <limits>

#include "estimate/common/cells.hpp"

namespace lightwell::estimate {
namespace {

/// In radii of the disc with a cell's solid angle. Beyond kReach a cell gives nothing; the corner of a tile twice as
/// long as wide lies at kSeen, and where nothing is that near, nobody looks.
constexpr double kReach = 2, kSeen = 1.4;
constexpr int kMaxSinkhornIterations = 200;
constexpr double kSinkhornTolerance = 1e-6;
/// A texel of whose samples a larger share is seen lies inside, not at the rim.
constexpr double kInside = 0.999;

/// Squared chord of an angle: what squared distances of unit vectors are compared with.
float chord2(double angle) {
  const double c = 2 * std::sin(std::min(angle, std::numbers::pi) / 2);
  return static_cast<float>(c * c);
}

float distance2(Vec3f a, Vec3f b) { return dot(a - b, a - b); }

/// Samples of the sphere by boxes of space, to find those around a direction.
class Boxes {
 public:
  explicit Boxes(std::span<const OctahedralGrid::Sample> samples) : begin_(kSide * kSide * kSide + 1) {
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

/// Solid angle that a cell and a sample, later a cell and a texel, have in common.
struct Shared {
  std::uint32_t at, cell;
  double sr;
};

class Splat {
 public:
  Splat(std::span<const Vec3f> direction, std::span<const float> solid_angle, const OctahedralGrid& grid)
      : direction_(direction), solid_angle_(solid_angle), grid_(grid), boxes_(grid.sample) {
    for (std::size_t c = 0; c < size(); ++c)
      if (usable(c)) covered_ += solid_angle_[c];
    whole_ = covered_ > kFullCoverage * 4 * std::numbers::pi;
  }

  SparseRows make() {
    evaluate_kernels();
    if (whole_) close_gaps();
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

  /// The kernel of every cell at the samples around it.
  void evaluate_kernels() {
    seen_.assign(grid_.sample.size(), 0);
    for (std::size_t c = 0; c < size(); ++c) {
      if (!usable(c)) continue;
      const double radius = std::acos(1 - std::min(2.0, solid_angle_[c] / (2 * std::numbers::pi)));
      const float reach2 = chord2(kReach * radius), seen2 = chord2(kSeen * radius);
      boxes_.around(direction_[c], std::sqrt(reach2), [&](std::uint32_t s) {
        const float d2 = distance2(grid_.sample[s].direction, direction_[c]);
        if (d2 >= reach2) return;
        const double slope = 1 - static_cast<double>(d2) / reach2;
        met_.push_back({s, static_cast<std::uint32_t>(c), slope * slope});
        if (d2 <= seen2) seen_[s] = 1;
      });
    }
  }

  /// On a whole sphere no sample stays dark: those that no cell reaches take what is nearest.
  void close_gaps() {
    std::vector<char> reached(seen_.size(), 0);
    for (const Shared& m : met_) reached[m.at] = 1;
    for (std::size_t s = 0; s < seen_.size(); ++s) {
      seen_[s] = 1;
      if (reached[s] != 0) continue;
      const Vec3f d = grid_.sample[s].direction;
      float nearest2 = std::numeric_limits<float>::max();
      for (std::size_t c = 0; c < size(); ++c)
        if (usable(c)) nearest2 = std::min(nearest2, distance2(d, direction_[c]));
      const double reach2 = 4 * static_cast<double>(nearest2);
      for (std::size_t c = 0; c < size(); ++c) {
        if (!usable(c)) continue;
        const double slope = 1 - static_cast<double>(distance2(d, direction_[c])) / reach2;
        if (slope > 0) met_.push_back({static_cast<std::uint32_t>(s), static_cast<std::uint32_t>(c), slope * slope});
      }
    }
  }

  /// Each seen sample is shared out among the cells that meet there; then by texel and cell.
  void gather_texels() {
    std::vector<double> sum(seen_.size(), 0);
    std::vector<char> given(size(), 0);
    inside_.assign(grid_.texels(), 0);
    for (const Shared& m : met_) sum[m.at] += m.sr;
    for (std::size_t s = 0; s < seen_.size(); ++s)
      if (seen_[s] != 0) inside_[s / grid_.per_texel()] += grid_.sample[s].solid_angle;
    for (const Shared& m : met_) {
      if (seen_[m.at] == 0) continue;
      parts_.push_back({static_cast<std::uint32_t>(m.at / grid_.per_texel()), m.cell,
                        m.sr / sum[m.at] * grid_.sample[m.at].solid_angle});
      given[m.cell] = 1;
    }
    met_.clear();
    // Cells between the samples.
    for (std::size_t c = 0; c < size(); ++c)
      if (usable(c) && given[c] == 0)
        parts_.push_back({static_cast<std::uint32_t>(grid_.texel_of(direction_[c])), static_cast<std::uint32_t>(c),
                          solid_angle_[c]});
    std::sort(parts_.begin(), parts_.end(),
              [](const Shared& a, const Shared& b) { return a.at != b.at ? a.at < b.at : a.cell < b.cell; });
    std::size_t kept = 0;
    for (const Shared& p : parts_) {
      if (kept > 0 && parts_[kept - 1].at == p.at && parts_[kept - 1].cell == p.cell)
        parts_[kept - 1].sr += p.sr;
      else
        parts_[kept++] = p;
    }
    parts_.resize(kept);
  }

  void sinkhorn_balance() {
    const double full = whole_ ? 4 * std::numbers::pi / covered_ : 1;
    std::vector<double> of_texel(grid_.texels()), of_cell(size());
    for (int round = 0; round < kMaxSinkhornIterations; ++round) {
      // A whole sphere ends with the texels, so that constant is constant to the last digit; a part of one with the
      // cells, so that no light is lost at its rim.
      const bool texels = (round % 2 == 1) == whole_;
      auto& sum = texels ? of_texel : of_cell;
      std::fill(sum.begin(), sum.end(), 0.0);
      for (const Shared& p : parts_) sum[texels ? p.at : p.cell] += p.sr;
      double worst = 0;
      for (std::size_t k = 0; k < sum.size(); ++k) {
        if (!(sum[k] > 0)) continue;
        const double target = texels ? grid_.solid_angle[k] : full * solid_angle_[k];
        const bool free = texels && !whole_ && inside_[k] < kInside * grid_.solid_angle[k];
        sum[k] = free ? 1 : target / sum[k];
        worst = std::max(worst, std::abs(sum[k] - 1));
      }
      for (Shared& p : parts_) p.sr *= sum[texels ? p.at : p.cell];
      if (worst < kSinkhornTolerance && round % 2 == 1) return;
    }
  }

  [[nodiscard]] SparseRows rows() const {
    SparseRows out;
    std::vector<SparseRows::Entry> row;
    std::size_t at = 0;
    for (std::size_t texel = 0; texel < grid_.texels(); ++texel) {
      row.clear();
      for (; at < parts_.size() && parts_[at].at == texel; ++at) {
        const Shared& p = parts_[at];
        row.push_back({p.cell, static_cast<float>(p.sr / (solid_angle_[p.cell] * grid_.solid_angle[texel]))});
      }
      out.add_row(row);
    }
    return out;
  }

  std::span<const Vec3f> direction_;
  std::span<const float> solid_angle_;
  const OctahedralGrid& grid_;
  Boxes boxes_;
  double covered_ = 0;
  bool whole_ = false;
  std::vector<Shared> met_, parts_;
  std::vector<char> seen_;
  std::vector<double> inside_;  ///< Seen solid angle of each texel.
};

}  // namespace

SparseRows splat_rows(std::span<const Vec3f> direction, std::span<const float> solid_angle,
                      const OctahedralGrid& grid) {
  return Splat(direction, solid_angle, grid).make();
}

}  // namespace lightwell::estimate
