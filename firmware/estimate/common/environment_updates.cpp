#include "estimate/common/environment_updates.hpp"

#include <utility>

#include <lightwell/descriptor.hpp>
#include <lightwell/lobes.hpp>
#include <lightwell/pixel.hpp>

namespace lightwell::estimate {
namespace {

constexpr int kMaxBaseEdge = 64;
/// Samples along an edge of the square: 0.3 to 1.5 degrees apart, fine compared with the cells of any rig.
constexpr int kSamplesAcross = 256;

/// Largest half side of a texel that is used as a whole: relative to the angle over which the lobe changes by its own
/// value, and absolute, because the widest lobe still ends at the horizon.
constexpr double kRelativeResolution = 0.1, kMaxResolution_rad = 0.06;
/// Texels of less weight are left out; their sum is below the rounding of RGB9E5.
constexpr double kMinWeight = 1e-7;

/// Computes the row of weights for one direction.
class LobeRow {
 public:
  LobeRow(const OctahedralGrid& grid, const MeanPyramid& pyramid, double roughness)
      : grid_(grid), pyramid_(pyramid), lobe_(roughness), width_(2 * roughness * roughness), weight_(pyramid.size()) {
    for (const auto& layer : pyramid.layers()) half_side_.push_back(0.5 * std::sqrt(4 * std::numbers::pi) / layer.edge);
    for (int j = 0; j < grid.edge; ++j)
      for (int i = 0; i < grid.edge; ++i) centre_.push_back(texel_direction(grid.edge, i, j));
  }

  std::span<const SparseRows::Entry> weights_at(Vec3f centre) {
    compute_texel_weights(centre);
    for (std::size_t k = 1; k < pyramid_.layers().size(); ++k) compute_layer_weights(k);
    row_.clear();
    const auto& coarsest = pyramid_.layers().back();
    for (int j = 0; j < coarsest.edge; ++j)
      for (int i = 0; i < coarsest.edge; ++i) add_part(centre, pyramid_.layers().size() - 1, i, j);
    double sum = 0;
    for (const auto& e : row_) sum += e.weight;
    for (auto& e : row_) e.weight = static_cast<float>(e.weight / sum);
    return row_;
  }

 private:
  /// Half side of a texel, rad, at an angle with this cosine from the lobe's middle, over which the lobe is nearly
  /// flat. The lobe changes by its value over its width in the middle, over the angle from it farther out.
  [[nodiscard]] double resolution(double cosine) const {
    return std::min(kMaxResolution_rad,
                    kRelativeResolution * std::sqrt(width_ * width_ + 2 * std::max(0.0, 1 - cosine)));
  }

  void compute_texel_weights(Vec3f centre) {
    // 1 - cos is computed from the chord: in float, the cosine has too few digits near the middle of a narrow lobe.
    const auto cosine_to = [centre](Vec3f d) {
      const Vec3f chord = d - centre;
      return 1 - 0.5 * static_cast<double>(dot(chord, chord));
    };
    for (std::size_t texel = 0; texel < grid_.texels(); ++texel) {
      if (const double cosine = cosine_to(centre_[texel]); half_side_[0] < resolution(cosine)) {
        weight_[texel] = lobe_.value(cosine) * grid_.solid_angle[texel];
        continue;
      }
      const auto samples = std::span(grid_.sample).subspan(texel * grid_.per_texel(), grid_.per_texel());
      double w = 0;
      for (const auto& s : samples) w += lobe_.value(cosine_to(s.direction)) * s.solid_angle;
      weight_[texel] = w;
    }
  }

  void compute_layer_weights(std::size_t k) {
    const auto& fine = pyramid_.layers()[k - 1];
    const auto& coarse = pyramid_.layers()[k];
    for (int j = 0; j < coarse.edge; ++j)
      for (int i = 0; i < coarse.edge; ++i) {
        double w = 0;
        for (int dj = 0; dj < 2; ++dj)
          for (int di = 0; di < 2; ++di) w += weight_[at(fine, 2 * i + di, 2 * j + dj)];
        weight_[at(coarse, i, j)] = w;
      }
  }

  void add_part(Vec3f centre, std::size_t k, int i, int j) {
    const auto& layer = pyramid_.layers()[k];
    const std::size_t index = at(layer, i, j);
    if (weight_[index] < kMinWeight) return;
    const double cosine = dot(texel_direction(layer.edge, i, j), centre);
    if (k == 0 || half_side_[k] < resolution(cosine)) {
      row_.push_back({static_cast<std::uint32_t>(index), static_cast<float>(weight_[index])});
      return;
    }
    for (int dj = 0; dj < 2; ++dj)
      for (int di = 0; di < 2; ++di) add_part(centre, k - 1, 2 * i + di, 2 * j + dj);
  }

  static std::size_t at(const MeanPyramid::Layer& layer, int i, int j) {
    return layer.first + static_cast<std::size_t>(j) * static_cast<std::size_t>(layer.edge) +
           static_cast<std::size_t>(i);
  }

  const OctahedralGrid& grid_;
  const MeanPyramid& pyramid_;
  GgxLobe lobe_;
  double width_;
  std::vector<double> weight_;     ///< Integral of the lobe over each texel of all layers.
  std::vector<Vec3f> centre_;      ///< Of each texel of the map.
  std::vector<double> half_side_;  ///< Of a texel of mean solid angle, rad, by layer.
  std::vector<SparseRows::Entry> row_;
};

/// Rows that convert a pyramid to the texels of a level: radiance(d, r) at the centre of each texel (lobes.hpp). Near
/// the middle of the lobe, rows use single texels, farther out, where the lobe is flat, texels of coarser layers.
/// Weights are the lobe's integral over the samples of each texel; they sum to 1.
SparseRows lobe_rows(const OctahedralGrid& grid, const MeanPyramid& pyramid, int edge, double roughness) {
  SparseRows out;
  LobeRow row(grid, pyramid, roughness);
  for (int j = 0; j < edge; ++j)
    for (int i = 0; i < edge; ++i) out.add_row(row.weights_at(texel_direction(edge, i, j)));
  return out;
}

OctahedralGrid base_grid(int edge) {
  const int base = std::min(2 * edge, kMaxBaseEdge);
  return {base, kSamplesAcross / base};
}

/// The brightest texel of a whole map is scaled to [2^7, 2^8) of RGB9E5's range up to 2^16: until the next whole map,
/// radiance may grow by a factor of 256, and texels down to 2^-23 of it have all nine bits.
constexpr int kHeadroom = 7;
constexpr double kMaxTexel = 65408;

float largest(const Rgbx& c) { return std::max({c.v[0], c.v[1], c.v[2]}); }

Duration seconds(double s) { return Duration::from_seconds(std::clamp(s, 1e-3, 1e6)); }

std::uint32_t encode_texel(const Rgbx& c, double unit) {
  const auto in_units = [unit](float v) { return static_cast<float>(std::min(v * unit, kMaxTexel)); };
  return rgb9e5_encode(in_units(c.v[0]), in_units(c.v[1]), in_units(c.v[2]));
}

/// Appends run lengths, alternately of texels that are unchanged and of those that are sent.
class Runs {
 public:
  explicit Runs(std::vector<std::uint32_t>& out) : out_(out) {}
  void add(bool sent) {
    if (!sent) finish();
    ++(sent ? sent_ : unchanged_);
  }
  void finish() {
    if (sent_ == 0) return;
    out_.push_back(unchanged_);
    out_.push_back(sent_);
    unchanged_ = sent_ = 0;
  }

 private:
  std::vector<std::uint32_t>& out_;
  std::uint32_t unchanged_ = 0, sent_ = 0;
};

void reserve(EnvironmentMap& map, std::span<const EnvironmentLevel> levels) {
  const std::size_t texels = texel_count(levels),
                    first = texel_count(levels.first(std::min<std::size_t>(levels.size(), 1)));
  map.levels.reserve(levels.size());
  map.texels.reserve(texels);
  map.runs.reserve(texels + 1);
  map.light_tracks.reserve(kMaxLights);
  map.light_runs.reserve(first + 1);
  map.light_texels.reserve(first);
}

}  // namespace

std::vector<EnvironmentLevel> environment_levels(int edge) {
  if (!is_environment_edge(static_cast<std::uint64_t>(std::max(edge, 0)))) return {};
  if (edge == 8) return {{8, 0}, {8, 0.5F}, {8, 0.75F}, {8, 1}};
  // The lobe's full width at half maximum is 2.6 roughness² rad, the mean width of a texel 3.5 / edge rad.
  const int middle = std::min(edge, 32), wide = std::min(edge / 2, 16);
  return {{edge, 0}, {middle, 0.25F}, {edge == 64 ? 32 : 16, 0.5F}, {wide, 0.75F}, {wide, 1}};
}

MeanPyramid::MeanPyramid(const OctahedralGrid& grid) {
  std::vector<double> solid_angle = grid.solid_angle;
  layers_.push_back({grid.edge, 0, {}});
  while (layers_.back().edge > kMinEdge) {
    const Layer& fine = layers_.back();
    Layer coarse{fine.edge / 2, fine.first + solid_angle.size(), {}};
    std::vector<double> sums;
    for (int j = 0; j < coarse.edge; ++j)
      for (int i = 0; i < coarse.edge; ++i) {
        std::array<SparseRows::Entry, 4> row;
        double sum = 0;
        for (std::size_t k = 0; k < 4; ++k) {
          const int fine_i = 2 * i + static_cast<int>(k % 2), fine_j = 2 * j + static_cast<int>(k / 2);
          row[k].index = static_cast<std::uint32_t>(fine_j * fine.edge + fine_i);
          sum += solid_angle[row[k].index];
        }
        for (auto& e : row) e.weight = static_cast<float>(solid_angle[e.index] / sum);
        coarse.means.add_row(row);
        sums.push_back(sum);
      }
    solid_angle = std::move(sums);
    layers_.push_back(std::move(coarse));
  }
}

void MeanPyramid::apply(std::span<Rgbx> list) const {
  for (std::size_t k = 1; k < layers_.size(); ++k) {
    const Layer& coarse = layers_[k];
    const auto fine = list.subspan(layers_[k - 1].first, coarse.first - layers_[k - 1].first);
    coarse.means.apply(fine, list.subspan(coarse.first, coarse.means.rows()));
  }
}

EnvironmentFilter::EnvironmentFilter(std::span<const Vec3f> direction, std::span<const float> solid_angle, int edge)
    : levels_(environment_levels(edge)),
      base_(base_grid(levels_.empty() ? 8 : edge)),
      pyramid_(base_),
      splat_(splat_rows(direction, solid_angle, base_)),
      light_(std::min(direction.size(), solid_angle.size())),
      means_(pyramid_.size()),
      texels_(texel_count(levels_)),
      weight_(base_.texels()),
      added_(base_.texels() + base_.texels() / 4),
      first_level_(levels_.empty() ? 0 : texel_count(std::span(levels_).first(1))) {
  for (std::size_t k = 1; k < levels_.size(); ++k)
    lobes_.push_back(lobe_rows(base_, pyramid_, levels_[k].edge, static_cast<double>(levels_[k].roughness)));
}

std::span<const Rgbx> EnvironmentFilter::run(std::span<const CellSum> sums, std::span<const Rgbx> measured) {
  const auto clean = [](float v) { return v > 0 && v <= kMaxCellSum ? v : 0.0F; };
  for (std::size_t c = 0; c < light_.size(); ++c) {
    const CellSum s = c < sums.size() ? sums[c] : CellSum{};
    light_[c].v = {clean(s.r), clean(s.g), clean(s.b), 0};
  }
  splat_.apply(light_, std::span(means_).first(splat_.rows()));
  std::fill(weight_.begin(), weight_.end(), 0.0F);
  for (std::size_t texel = 0; texel < std::min(measured.size(), splat_.rows()); ++texel) {
    const float weight = weight_[texel] = measured[texel].v[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const float mean = (1 - weight) * means_[texel].v[k] + weight * measured[texel].v[k];
      means_[texel].v[k] = std::isfinite(mean) ? mean : 0;
    }
  }
  pyramid_.apply(means_);
  if (levels_.empty()) return {};
  const auto sharp = std::find_if(pyramid_.layers().begin(), pyramid_.layers().end(),
                                  [this](const auto& layer) { return layer.edge == levels_[0].edge; });
  std::size_t next = texel_count(std::span(levels_).first(1));
  std::copy_n(means_.begin() + static_cast<std::ptrdiff_t>(sharp->first), next, texels_.begin());
  for (const SparseRows& rows : lobes_) {
    rows.apply(means_, std::span(texels_).subspan(next, rows.rows()));
    next += rows.rows();
  }
  for (Rgbx& texel : texels_)
    for (float& v : texel.v) v = v > 0 ? v : 0;
  return texels_;
}

std::span<const Rgbx> EnvironmentFilter::first_level_with(std::span<const Rgbx> added) {
  for (std::size_t texel = 0; texel < std::min(added.size(), weight_.size()); ++texel)
    for (std::size_t k = 0; k < 3; ++k) added_[texel].v[k] = weight_[texel] * added[texel].v[k];
  std::size_t first = 0;
  if (!levels_.empty() && levels_[0].edge != base_.edge) {
    const MeanPyramid::Layer& half = pyramid_.layers()[1];
    first = half.first;
    half.means.apply(added_, std::span(added_).subspan(first, half.texels()));
  }
  for (std::size_t texel = 0; texel < first_level_.size(); ++texel)
    for (std::size_t k = 0; k < 3; ++k) {
      const float v = means_[first + texel].v[k] + added_[first + texel].v[k];
      first_level_[texel].v[k] = std::isfinite(v) && v > 0 ? v : 0;
    }
  return first_level_;
}

EnvironmentUpdates::EnvironmentUpdates(std::vector<EnvironmentLevel> levels, EnvironmentUpdateOptions options)
    : options_(options) {
  const std::size_t texels = texel_count(levels);
  for (EnvironmentMap* map : {&key_, &changes_, &spare_}) reserve(*map, levels);
  key_.levels.assign(levels.begin(), levels.end());
  key_.texels.resize(texels);
}

bool EnvironmentUpdates::key_due(ProbeTime time) const {
  return key_.key == 0 || time < last_ || time - key_time_ >= seconds(options_.key_interval_s);
}

bool EnvironmentUpdates::fits_key(float most) const {
  return std::ldexp(static_cast<double>(most), -key_.exponent) <= kMaxTexel;
}

void EnvironmentUpdates::reclaim(std::optional<EnvironmentMap>& out) {
  const auto keeps = [&](const auto& member) { return ((*out).*member).capacity() >= (spare_.*member).capacity(); };
  if (out && keeps(&EnvironmentMap::texels) && keeps(&EnvironmentMap::runs) && keeps(&EnvironmentMap::light_tracks) &&
      keeps(&EnvironmentMap::light_runs) && keeps(&EnvironmentMap::light_texels))
    std::swap(*out, spare_);
  out.reset();
}

void EnvironmentUpdates::update(std::span<const Rgbx> texels, const FirstLevel& with_lights, double factor,
                                ProbeTime time, std::optional<EnvironmentMap>& out) {
  reclaim(out);
  if (!due(time) || texels.size() != key_.texels.size() || !(factor > 0) || !std::isfinite(factor)) return;
  float most = 0;
  for (const Rgbx& c : texels) most = std::max(most, largest(c));
  for (const Rgbx& c : with_lights.texels) most = std::max(most, largest(c));
  most = static_cast<float>(std::min(most * factor, 1e35));
  bool whole = key_due(time) || !fits_key(most);
  if (!whole) {
    find_changes(texels, factor);
    // A whole map is preferred where changes cost as much, because every reader can decode it.
    whole = 4 * changes_.texels.size() + changes_.runs.size() >= 3 * key_.texels.size();
  }
  if (whole) make_key(texels, factor, most, time);

  // A fixed schedule, not a delay after each map, keeps the mean rate for all frame periods.
  const Duration period = seconds(1 / std::max(options_.rate_hz, 1e-6));
  const bool on_schedule = started_ && time >= next_ && time - next_ < period;
  next_ = (on_schedule ? next_ : time) + period;
  last_ = time;
  started_ = true;

  out.emplace(std::move(spare_));
  // Copies into the memory of the vectors.
  *out = whole ? key_ : changes_;
  out->key = key_.key;
  add_lights(texels, with_lights, factor, *out);
}

/// The map's exponent is set.
void EnvironmentUpdates::add_lights(std::span<const Rgbx> texels, const FirstLevel& with_lights, double factor,
                                    EnvironmentMap& out) const {
  out.light_tracks.clear();
  out.light_runs.clear();
  out.light_texels.clear();
  const double unit = std::ldexp(factor, -key_.exponent);
  Runs runs(out.light_runs);
  for (std::size_t k = 0; k < with_lights.texels.size(); ++k) {
    const bool differs = with_lights.texels[k].v != texels[k].v;
    if (differs) out.light_texels.push_back(encode_texel(with_lights.texels[k], unit));
    runs.add(differs);
  }
  runs.finish();
  if (!out.light_texels.empty()) out.light_tracks.assign(with_lights.tracks.begin(), with_lights.tracks.end());
}

void EnvironmentUpdates::make_key(std::span<const Rgbx> texels, double factor, float most, ProbeTime time) {
  key_.exponent =
      most > 0 ? std::clamp(std::ilogb(most) - kHeadroom, kMinEnvironmentExponent, kMaxEnvironmentExponent) : 0;
  const double unit = std::ldexp(factor, -key_.exponent);
  for (std::size_t k = 0; k < texels.size(); ++k) key_.texels[k] = encode_texel(texels[k], unit);
  // A key that is due is sent with the next map, which may be one period later.
  const double interval_s = options_.key_interval_s + 1 / std::max(options_.rate_hz, 1e-6);
  key_.key_interval_ms = static_cast<std::uint32_t>(seconds(interval_s).milliseconds());
  key_.key = environment_key(key_);
  key_time_ = time;
}

void EnvironmentUpdates::find_changes(std::span<const Rgbx> texels, double factor) {
  changes_.texels.clear();
  changes_.runs.clear();
  const double unit = std::ldexp(factor, -key_.exponent);
  Runs runs(changes_.runs);
  std::size_t at = 0;
  for (const EnvironmentLevel& level : key_.levels) {
    const std::size_t count = texel_count(std::span(&level, 1));
    double sum = 0;
    for (const Rgbx& c : texels.subspan(at, count)) sum += largest(c);
    const double min_texel = kMinRelativeTexel * unit * sum / static_cast<double>(count);
    for (const std::size_t end = at + count; at < end; ++at) {
      const std::array<float, 3> old = rgb9e5_decode(key_.texels[at]);
      const double min_difference = options_.step * std::max(unit * largest(texels[at]), min_texel);
      bool differs = false;
      for (std::size_t k = 0; k < 3; ++k)
        differs = differs || std::abs(std::min(unit * texels[at].v[k], kMaxTexel) - old[k]) > min_difference;
      const std::uint32_t now = differs ? encode_texel(texels[at], unit) : 0;
      const bool sent = differs && now != key_.texels[at];
      if (sent) changes_.texels.push_back(now);
      runs.add(sent);
    }
  }
  runs.finish();
}

}  // namespace lightwell::estimate
