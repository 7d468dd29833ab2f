// Building blocks of the environment filter: the octahedral map, a sparse matrix for colours, and splatting.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include <lightwell/octahedral.hpp>

namespace lightwell::estimate {

/// Three channels and padding, so that one vector load reads a colour.
struct alignas(16) Rgbx {
  std::array<float, 4> v{};
};

/// out[row] = sum of weight * in[index].
class SparseRows {
 public:
  struct Entry {
    std::uint32_t index = 0;
    float weight = 0;
  };

  void add_row(std::span<const Entry> row) {
    entries_.insert(entries_.end(), row.begin(), row.end());
    end_.push_back(entries_.size());
  }
  [[nodiscard]] std::size_t rows() const { return end_.size(); }

  /// `out` has rows() elements, which may follow those of `in` in the same array.
  void apply(std::span<const Rgbx> in, std::span<Rgbx> out) const {
    std::size_t at = 0;
    for (std::size_t row = 0; row < end_.size(); ++row) {
      // Four independent sums hide the latency of additions.
      std::array<Rgbx, 4> sum{};
      const std::size_t end = end_[row];
      for (; at + 4 <= end; at += 4)
        for (std::size_t lane = 0; lane < 4; ++lane) add(entries_[at + lane], in, sum[lane]);
      for (; at < end; ++at) add(entries_[at], in, sum[0]);
      for (std::size_t k = 0; k < 4; ++k) out[row].v[k] = (sum[0].v[k] + sum[1].v[k]) + (sum[2].v[k] + sum[3].v[k]);
    }
  }

 private:
  static void add(Entry e, std::span<const Rgbx> in, Rgbx& sum) {
    const Rgbx& c = in[e.index];
    for (std::size_t k = 0; k < 4; ++k) sum.v[k] += e.weight * c.v[k];
  }

  std::vector<Entry> entries_;
  std::vector<std::size_t> end_;
};

/// Directions and solid angles of the texels of an octahedral map (Engelhardt & Dachsbacher 2008, "Octahedron
/// environment maps"): a square of edge x edge texels with samples x samples points each. Solid angles are normalized
/// to a sum of 4 pi.
struct OctahedralGrid {
  struct Sample {
    Vec3f direction;
    float solid_angle;
  };

  OctahedralGrid(int edge_, int samples_) : edge(edge_), samples(samples_), solid_angle(texels()) {
    const int fine = edge * samples;
    sample.reserve(static_cast<std::size_t>(fine) * static_cast<std::size_t>(fine));
    const auto n = static_cast<float>(fine);
    double total = 0;
    for (std::size_t texel = 0; texel < texels(); ++texel) {
      const int i0 = static_cast<int>(texel) % edge * samples, j0 = static_cast<int>(texel) / edge * samples;
      for (int j = j0; j < j0 + samples; ++j)
        for (int i = i0; i < i0 + samples; ++i) {
          const Vec3f d = oct_decode({(static_cast<float>(i) + 0.5F) / n, (static_cast<float>(j) + 0.5F) / n});
          // The square is the unfolded octahedron |x|+|y|+|z| = 1. An area dA of it at the distance r from the centre
          // has a solid angle proportional to dA / r³, with r = 1 / (|x|+|y|+|z|) for the unit vector.
          const double inverse = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
          const double sr = inverse * inverse * inverse;
          sample.push_back({d, static_cast<float>(sr)});
          total += sr;
        }
    }
    const double scale = 4 * std::numbers::pi / total;
    for (std::size_t k = 0; k < sample.size(); ++k) {
      sample[k].solid_angle = static_cast<float>(sample[k].solid_angle * scale);
      solid_angle[k / per_texel()] += sample[k].solid_angle;
    }
  }

  [[nodiscard]] std::size_t texels() const { return static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge); }
  [[nodiscard]] std::size_t per_texel() const {
    return static_cast<std::size_t>(samples) * static_cast<std::size_t>(samples);
  }
  [[nodiscard]] std::size_t texel_of(Vec3f d) const {
    const OctUv uv = oct_encode(d);
    const auto at = [this](float u) { return std::clamp(static_cast<int>(u * static_cast<float>(edge)), 0, edge - 1); };
    return static_cast<std::size_t>(at(uv.v)) * static_cast<std::size_t>(edge) + static_cast<std::size_t>(at(uv.u));
  }

  int edge, samples;
  std::vector<double> solid_angle;  ///< Of each texel, sr.
  std::vector<Sample> sample;       ///< per_texel() for each texel, in the order of texels.
};

/// Resamples cells to an octahedral map: rows that convert the cells' integrals of radiance to the mean radiance of
/// each texel. A smooth kernel of about twice the cell's radius fills texels between the centres of coarse cells. The
/// weights are then balanced alternately (Sinkhorn & Knopp 1967, "Concerning nonnegative matrices and doubly stochastic
/// matrices") until the rows of every texel sum to its solid angle and those of every cell to its own: a constant
/// sphere remains constant, and energy is conserved.
///
/// `direction` (unit, probe frame) and `solid_angle` (sr; cells with 0 are ignored) correspond; cells should not
/// overlap. Where they cover the sphere (kFullCoverage), gaps are filled from the nearest cells. Otherwise directions
/// beyond the reach of every cell stay dark; callers add cells for unseen directions if they are to be filled.
[[nodiscard]] SparseRows splat_rows(std::span<const Vec3f> direction, std::span<const float> solid_angle,
                                    const OctahedralGrid& grid);

}  // namespace lightwell::estimate
