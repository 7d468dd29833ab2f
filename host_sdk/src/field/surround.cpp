#include "field/surround.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace lightwell::field {
namespace {

constexpr std::size_t kNearestProbes = 8;
constexpr auto kCoefficients = static_cast<std::size_t>(sh_count(Surround::kBand));

struct DirectionTable {
  std::array<Vec3f, Surround::kDirections> directions;
  std::array<std::array<float, kCoefficients>, Surround::kDirections> basis;

  DirectionTable() {
    for (std::size_t i = 0; i < directions.size(); ++i) {
      directions[i] = vec_cast<float>(fibonacci_direction(static_cast<int>(i), static_cast<int>(directions.size())));
      sh_basis(Surround::kBand, directions[i], basis[i]);
    }
  }
  static const DirectionTable& get() {
    static const DirectionTable table;
    return table;
  }
};

}  // namespace

Surround::Surround(std::shared_ptr<const Proxy> proxy, std::span<const ProbeView> views,
                   std::span<const RadianceSh> residuals)
    : proxy_(std::move(proxy)) {
  Radiance mean;
  for (const RadianceSh& r : residuals) mean += r.c[0] * (0.282095F / static_cast<float>(residuals.size()));
  std::vector<std::pair<double, std::size_t>> nearest;
  for (const Vec3d& texel : proxy_->texels()) {
    nearest.clear();
    for (std::size_t v = 0; v < views.size(); ++v) nearest.emplace_back(length(texel - views[v].origin), v);
    const std::size_t count = std::min(nearest.size(), kNearestProbes);
    std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(count), nearest.end());
    Radiance sum;
    double weights = 0;
    for (std::size_t n = 0; n < count; ++n) {
      const auto [distance, v] = nearest[n];
      if (distance < 1e-3 || proxy_->occluded(views[v].origin, texel, 0.02)) continue;
      const Vec3f d = vec_cast<float>((texel - views[v].origin) * (1 / distance));
      const double w = 1 / (distance * distance);
      sum += evaluate(residuals[v], d) * static_cast<float>(w);
      weights += w;
    }
    Radiance radiance = weights > 0 ? sum * static_cast<float>(1 / weights) : mean;
    for (int c = 0; c < 3; ++c) radiance[c] = std::max(radiance[c], 0.0F);
    texels_.push_back(radiance);
  }
}

RadianceSh Surround::seen_from(Vec3d point) const {
  const DirectionTable& table = DirectionTable::get();
  std::array<std::uint32_t, kDirections> hits;
  proxy_->first_texels(point, table.directions, hits);
  RadianceSh out;
  out.band = kBand;
  constexpr float kWeight = 4 * std::numbers::pi_v<float> / static_cast<float>(kDirections);
  for (std::size_t i = 0; i < kDirections; ++i) {
    if (hits[i] == Proxy::kNoTexel) continue;
    const Radiance radiance = texels_[hits[i]] * kWeight;
    for (std::size_t k = 0; k < kCoefficients; ++k) out.c[k] += radiance * table.basis[i][k];
  }
  return out;
}

}  // namespace lightwell::field
