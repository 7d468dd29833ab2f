#include "estimate/common/environment_updates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <lightwell/pixel.hpp>

namespace lightwell::estimate {
namespace {

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

void reserve(EnvironmentMap& map, std::size_t texels, std::size_t levels) {
  map.levels.reserve(levels);
  map.texels.reserve(texels);
  map.runs.reserve(texels + 1);
}

}  // namespace

EnvironmentUpdates::EnvironmentUpdates(std::vector<EnvironmentLevel> levels, EnvironmentUpdateOptions options)
    : options_(options) {
  const std::size_t texels = texel_count(levels);
  for (EnvironmentMap* map : {&key_, &changes_, &spare_}) reserve(*map, texels, levels.size());
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
  if (out && out->texels.capacity() >= spare_.texels.capacity() && out->runs.capacity() >= spare_.runs.capacity())
    std::swap(*out, spare_);
  out.reset();
}

void EnvironmentUpdates::update(std::span<const Rgbx> texels, double factor, ProbeTime time,
                                std::optional<EnvironmentMap>& out) {
  reclaim(out);
  if (!due(time) || texels.size() != key_.texels.size() || !(factor > 0) || !std::isfinite(factor)) return;
  float most = 0;
  for (const Rgbx& c : texels) most = std::max(most, largest(c));
  most = static_cast<float>(std::min(most * factor, 1e35));
  bool whole = key_due(time) || !fits_key(most);
  if (!whole) {
    find_changes(texels, factor);
    // A whole map is preferred where changes cost as much, because every reader can decode it.
    whole = 4 * changes_.texels.size() + changes_.runs.size() >= 3 * key_.texels.size();
  }
  if (whole) make_key(texels, factor, most, time);

  // A fixed schedule, not a delay after each map: the mean rate is kept where the frame period does not divide that of
  // maps.
  const Duration period = seconds(1 / std::max(options_.rate_hz, 1e-6));
  const bool on_schedule = started_ && time >= next_ && time - next_ < period;
  next_ = (on_schedule ? next_ : time) + period;
  last_ = time;
  started_ = true;

  out.emplace(std::move(spare_));
  // Copies into the memory of the vectors.
  *out = whole ? key_ : changes_;
  out->key = key_.key;
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
  std::uint32_t same = 0, changed = 0;
  const auto end_run = [&] {
    if (changed == 0) return;
    changes_.runs.push_back(same);
    changes_.runs.push_back(changed);
    same = changed = 0;
  };
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
      if (differs && now != key_.texels[at]) {
        ++changed;
        changes_.texels.push_back(now);
      } else {
        end_run();
        ++same;
      }
    }
  }
  end_run();
}

}  // namespace lightwell::estimate
