// Environment maps for estimators: from the sums of cells to the map in a descriptor, whole (keys) or as changes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/environment.hpp>
#include <lightwell/time.hpp>

#include "estimate/common/cells.hpp"

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
/// environment maps"): a square of edge x edge texels with samples x samples points each. Solid angles sum to 4 pi.
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

/// Lights that a mirror shows as texels, not as caps.
struct LightsInTexels {
  std::span<const std::uint32_t> tracks;  ///< Ascending; empty: there are none.
  /// By texel of a grid or of a map's first level, what these lights add to its radiance. Empty where there are none.
  std::span<const Rgbx> added;
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

/// Levels of a map with this edge: roughness 0, 0.25 (not for edge 8, whose texels are wider than that lobe), 0.5, 0.75
/// and 1, with texels narrower than half the lobe as far as `edge` allows. Empty for an invalid edge.
[[nodiscard]] std::vector<EnvironmentLevel> environment_levels(int edge);

/// A mip pyramid of an octahedral map: means over 2x2, 4x4, ... texels, down to 4x4 texels, all layers in one array.
class MeanPyramid {
 public:
  static constexpr int kMinEdge = 4;
  explicit MeanPyramid(const OctahedralGrid& grid);

  struct Layer {
    int edge;
    std::size_t first;  ///< Index of its first texel in the array.
    SparseRows means;   ///< From the previous layer; empty for the map itself.
    [[nodiscard]] std::size_t texels() const { return static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge); }
  };
  [[nodiscard]] const std::vector<Layer>& layers() const { return layers_; }
  [[nodiscard]] std::size_t size() const { return layers_.back().first + layers_.back().texels(); }
  /// Computes all layers from the map, which is at the start of the array.
  void apply(std::span<Rgbx> list) const;

 private:
  std::vector<Layer> layers_;
};

/// Precomputes weights from the cells of a rig, then applies them to each map. Not thread-safe.
class EnvironmentFilter {
 public:
  /// `direction` (unit, probe frame) and `solid_angle` (sr) of each cell; directions without a cell are dark
  /// (splat_rows()). `edge`: 8, 16, 32 or 64. Takes some tenths of a second.
  EnvironmentFilter(std::span<const Vec3f> direction, std::span<const float> solid_angle, int edge);

  [[nodiscard]] std::span<const EnvironmentLevel> levels() const { return levels_; }
  /// The grid from which lobes are integrated: twice the map's edge, at most 64.
  [[nodiscard]] const OctahedralGrid& grid() const { return base_; }

  /// Returns the texels of all levels in the order of EnvironmentMap::texels: radiance in units of the sums per sr,
  /// never negative or NaN. Sums that are negative, NaN, above kMaxCellSum or missing count as 0. `measured`: empty, or
  /// for each texel of grid() a mean radiance, which may be negative, and as fourth channel the weight, 0 to 1, with
  /// which it replaces that of the cells; where it is not finite, the texel is dark. Allocates nothing; the result is
  /// valid until the next call.
  [[nodiscard]] std::span<const Rgbx> run(std::span<const CellSum> sums, std::span<const Rgbx> measured = {});

  /// After run(): the first level with `added` in it, by texel of grid(), as far as pixels were measured there. Valid
  /// until the next call of either function.
  [[nodiscard]] std::span<const Rgbx> first_level_with(std::span<const Rgbx> added);

  /// Largest valid sum; products with all weights stay in the range of float.
  static constexpr float kMaxCellSum = 1e24F;

 private:
  std::vector<EnvironmentLevel> levels_;
  OctahedralGrid base_;
  MeanPyramid pyramid_;
  SparseRows splat_;
  std::vector<SparseRows> lobes_;  ///< Of the levels after the first.
  std::vector<Rgbx> light_;        ///< Valid sums of the cells.
  std::vector<Rgbx> means_;        ///< All layers of the pyramid.
  std::vector<Rgbx> texels_;
  std::vector<float> weight_;  ///< By texel of grid(), that of `measured`.
  std::vector<Rgbx> added_;    ///< The first layers of the pyramid: of the grid and of half its edge.
  std::vector<Rgbx> first_level_;
};

struct EnvironmentUpdateOptions {
  /// Largest mean rate of maps. A higher rate costs bandwidth and time for filtering.
  double rate_hz = 5;
  /// Interval of whole maps; the first map due after it is whole. Shorter costs bytes; longer lets a new reader wait.
  double key_interval_s = 1;
  /// A texel is sent again where a channel differs from the whole map by more than this share of the texel's largest
  /// channel, or of kMinRelativeTexel times the level's mean if that is more. Larger values save bytes.
  double step = 0.01;
};

/// Encodes maps; keeps the last whole map and the schedule. No allocation if maps are passed back to update(). Not
/// thread-safe.
class EnvironmentUpdates {
 public:
  EnvironmentUpdates(std::vector<EnvironmentLevel> levels, EnvironmentUpdateOptions options);

  /// Whether a map is due at `time` (mid-exposure). The first is, so is one before the last map (a new clock).
  [[nodiscard]] bool due(ProbeTime time) const { return !started_ || key_.key == 0 || time >= next_ || time < last_; }
  /// Makes the next map due at once and whole. For changes of the scale.
  void restart() { key_.key = 0; }

  /// The first level with lights, in units of the texels. Empty where there are none.
  struct FirstLevel {
    std::span<const std::uint32_t> tracks;  ///< Of these lights, ascending.
    std::span<const Rgbx> texels;
  };

  /// Where due(): sets `out` to the map of `texels` (descriptor radiance / factor, level by level), whole or as
  /// changes. Otherwise sets it to nullopt. Reuses the memory in `out`, which should hold the result of the previous
  /// call. Radiance outside of the encodable range is clamped.
  void update(std::span<const Rgbx> texels, const FirstLevel& with_lights, double factor, ProbeTime time,
              std::optional<EnvironmentMap>& out);

  /// Takes over the memory of `out` and sets it to nullopt.
  void reclaim(std::optional<EnvironmentMap>& out);

  static constexpr double kMinRelativeTexel = 0.1;

 private:
  [[nodiscard]] bool key_due(ProbeTime time) const;
  [[nodiscard]] bool fits_key(float largest) const;
  void make_key(std::span<const Rgbx> texels, double factor, float largest, ProbeTime time);
  void find_changes(std::span<const Rgbx> texels, double factor);
  void add_lights(std::span<const Rgbx> texels, const FirstLevel& with_lights, double factor,
                  EnvironmentMap& out) const;

  EnvironmentUpdateOptions options_;
  EnvironmentMap key_;      ///< The last whole map; key 0 where there is none.
  EnvironmentMap changes_;  ///< Texels and runs of the current map.
  EnvironmentMap spare_;    ///< Memory for the next result.
  ProbeTime last_, next_, key_time_;
  bool started_ = false;
};

/// Produces prefiltered maps at its own rate. Allocates all memory when constructed. Not thread-safe.
class EnvironmentMapper {
 public:
  /// Parameters as for EnvironmentFilter and EnvironmentUpdates.
  EnvironmentMapper(std::span<const Vec3f> direction, std::span<const float> solid_angle, int edge,
                    EnvironmentUpdateOptions options = {})
      : filter_(direction, solid_angle, edge), updates_({filter_.levels().begin(), filter_.levels().end()}, options) {}

  /// Whether update() reads the sums in this frame. With a factor other than that of the last map, it always does.
  [[nodiscard]] bool due(ProbeTime mid_exposure) const { return updates_.due(mid_exposure); }
  /// That of EnvironmentFilter.
  [[nodiscard]] const OctahedralGrid& grid() const { return filter_.grid(); }

  /// Sets `out` to a map where one is due, otherwise to nullopt. `sums`: integral of radiance over each cell without
  /// the lights, in the constructor's order of cells; ignored where no map is due. `measured`: as for
  /// EnvironmentFilter::run(), without the lights. `lights`: by texel of grid(). `factor`: descriptor radiance per unit
  /// of radiance in `sums`; where it has changed, a whole map is sent, because readers use the last map with newer
  /// descriptors. Allocates nothing where `out` is that of the previous call.
  void update(std::span<const CellSum> sums, std::span<const Rgbx> measured, const LightsInTexels& lights,
              double factor, ProbeTime mid_exposure, std::optional<EnvironmentMap>& out) {
    if (factor != factor_) updates_.restart();
    factor_ = factor;
    if (!updates_.due(mid_exposure)) return updates_.reclaim(out);
    const std::span<const Rgbx> texels = filter_.run(sums, measured);
    EnvironmentUpdates::FirstLevel with_lights;
    if (!lights.tracks.empty()) with_lights = {lights.tracks, filter_.first_level_with(lights.added)};
    updates_.update(texels, with_lights, factor, mid_exposure, out);
  }

 private:
  EnvironmentFilter filter_;
  EnvironmentUpdates updates_;
  double factor_ = 0;
};

}  // namespace lightwell::estimate
