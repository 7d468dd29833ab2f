#include "estimate/specular/reflectance_separation.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include <lightwell/pixel.hpp>
#include <lightwell/quantile.hpp>

namespace lightwell::specular {
namespace {

/// Reach of Tukey's biweight in standard deviations: 95 % efficient for a normal distribution (Huber 1981).
constexpr float kReach = 4.685F;
/// Relative deviation that no texel is better than: rounding to RGB9E5, interpolation.
constexpr float kMinRelativeDeviation = 0.004F;
constexpr int kMeanSteps = 2;
/// Every so many texels of a tile are examined for saturation: those of its diagonal.
constexpr int kClippedStride = kTileEdge + 1;
/// Of the refined poses, texels².
constexpr float kRegistrationVariance = 0.04F;
/// Nodes with less than this share of the mean weight have a few samples at edges of the texture; their values are off
/// by ten times as much as others. They count as unseen.
constexpr double kMinRelativeWeight = 0.03;
/// Above this share of saturated texels a node is a lower bound.
constexpr float kMaxClippedShare = 0.5F;
/// A sweep has at most about so many samples, so that S follows within a second or two: more are divided into 2 to
/// kMaxStride sweeps over different tiles.
constexpr std::size_t kSweepSamples = 1'200'000;
constexpr int kMaxStride = 16;
/// Work for a tile without samples, in samples.
constexpr std::size_t kTileCost = 16;

Radiance decoded(std::uint32_t rgb9e5) {
  const auto [r, g, b] = rgb9e5_decode(rgb9e5);
  return {r, g, b};
}

}  // namespace

ReflectanceSeparation::ReflectanceSeparation(const PlaneTexels& texels, int levels)
    : texels_(texels),
      medians_(texels.count()),
      diffuse_(texels.count()),
      blur_(texels.count()),
      specular_(levels),
      next_(levels),
      clipped_(specular_.grid.size()) {}

void ReflectanceSeparation::add_to_medians(const TexelImage& image, std::span<const std::uint32_t> first) {
  for (const std::uint32_t texel : first) {
    const TexelRadiance& t = image[texel];
    medians_[texel].add(t.r, t.g, t.b);
    if (sweeps_ > 0 && diffuse_[texel].seen()) continue;
    const auto& m = medians_[texel].value();
    diffuse_[texel] = {m[0], m[1], m[2], 0};
  }
}

void ReflectanceSeparation::add_clipped(const TexelImage& image, Vec3d lens) {
  const Vec3f eye = vec_cast<float>(lens);
  for (int tile = 0; tile < texels_.tiles() * texels_.tiles(); ++tile) {
    ClippedNode& node = clipped_[specular_.grid.nearest(eye - vec_cast<float>(texels_.tile_center(tile)))];
    for (int k = 0; k < kTileTexels; k += kClippedStride) {
      const std::size_t texel = texels_.texel_of(tile, k);
      const TexelRadiance& t = image[texel];
      if (!t.seen() || !diffuse_[texel].seen()) continue;
      // A pixel beside a saturated one is mixed with it: only texels that are saturated for the most part are bounds.
      if (!(t.clipped > 0.5F)) {
        node.measured += t.measured() ? 1.0F : 0.0F;
        continue;
      }
      ++node.clipped;
      const float rate = 1 / std::min(node.clipped, 100.0F);
      const Radiance over = t.radiance() - diffuse_[texel].radiance();
      node.color += rate * (over - node.color);
      const float bound = over.luminance(), scale = 0.5F * t.luminance();
      node.bound = node.clipped > 1 ? node.bound + rate * scale * (bound > node.bound ? 0.9F : -0.1F) : bound;
    }
  }
}

void ReflectanceSeparation::gather(const SurfaceLightField& light_field, int tile) {
  samples_.clear();
  const auto inverse_texel = static_cast<float>(1 / texels_.texel_m());
  const HemisphereGrid grid = specular_.grid;
  std::array<float, kTileTexels> x, y;
  for (int k = 0; k < kTileTexels; ++k) {
    const Vec3f center = vec_cast<float>(texels_.center(texels_.texel_of(tile, k)));
    x[static_cast<std::size_t>(k)] = center.x, y[static_cast<std::size_t>(k)] = center.y;
  }
  light_field.for_each_page(tile, [&](const LightFieldPage& page) {
    const SurfaceLightField::View* view = light_field.view_of(page.frame);
    if (view == nullptr) {
      const auto where = grid.interpolate(vec_cast<float>(light_field.grid().direction(page.node)));
      for (std::uint32_t k = 0; k < kTileTexels; ++k)
        if ((page.filled >> k & 1U) != 0) samples_.push_back({decoded(page.sample[k]), where, k, 0, 0});
      return;
    }
    // Of all texels, in arrays, so that the loop vectorises; texels without a sample are left out after it.
    std::array<std::array<std::uint32_t, kTileTexels>, 3> node;
    std::array<std::array<float, kTileTexels>, 3> weight;
    std::array<float, kTileTexels> weight_in_diffuse, blur;
    const SurfaceLightField::View v = *view;
    const float texels_per_pixel = v.pixel_rad * inverse_texel, square_scale = texels_per_pixel * texels_per_pixel;
    for (std::size_t k = 0; k < kTileTexels; ++k) {
      const Vec3f to_lens{v.lens.x - x[k], v.lens.y - y[k], v.lens.z};
      const auto where = grid.interpolate(to_lens);
      for (std::size_t n = 0; n < 3; ++n) node[n][k] = where.node[n], weight[n][k] = where.weight[n];
      const float square = dot(to_lens, to_lens), inverse_cosine = std::sqrt(square) / to_lens.z;
      // A pixel is `across` wide and `across` / cosine long; its density is the inverse area. Box and bilinear
      // interpolation have a variance of a quarter of the squared side.
      const float across = square_scale * square, density = 1 / (across * inverse_cosine);
      weight_in_diffuse[k] = density * density;
      blur[k] = 0.125F * across * (1 + inverse_cosine * inverse_cosine);
    }
    for (unsigned texels = page.filled; texels != 0; texels &= texels - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(texels));
      samples_.push_back({decoded(page.sample[k]),
                          {{node[0][k], node[1][k], node[2][k]}, {weight[0][k], weight[1][k], weight[2][k]}},
                          static_cast<std::uint32_t>(k),
                          weight_in_diffuse[k],
                          blur[k]});
    }
  });
}

void ReflectanceSeparation::update_tile(int tile) {
  const auto texel_of = [&](std::size_t k) { return texels_.texel_of(tile, static_cast<int>(k)); };
  // Start from the previous value (the first time: the median); a few steps of the biweight follow.
  std::array<Radiance, kTileTexels> mean{};
  std::array<float, kTileTexels> sigma{};
  for (std::size_t k = 0; k < kTileTexels; ++k) mean[k] = diffuse_[texel_of(k)].radiance();
  for (Sample& s : samples_) s.radiance = s.radiance - specular_.at(s.where);
  for (int step = 0; step < kMeanSteps; ++step) {
    std::array<float, kTileTexels> deviation{}, count{};
    for (const Sample& s : samples_) {
      deviation[s.k] += std::abs(s.radiance.luminance() - mean[s.k].luminance());
      ++count[s.k];
    }
    for (std::size_t k = 0; k < kTileTexels; ++k)
      sigma[k] = 1.25F * deviation[k] / std::max(count[k], 1.0F) + kMinRelativeDeviation * mean[k].luminance();
    struct Sum {
      Radiance radiance;
      float blur = 0, weight = 0;
    };
    std::array<Sum, kTileTexels> sum{};
    for (const Sample& s : samples_) {
      const float u = (s.radiance.luminance() - mean[s.k].luminance()) / (kReach * sigma[s.k]);
      if (!(u * u < 1)) continue;
      const float weight = (1 - u * u) * (1 - u * u) * s.weight;
      sum[s.k].radiance += weight * s.radiance;
      sum[s.k].blur += weight * s.blur;
      sum[s.k].weight += weight;
    }
    for (std::size_t k = 0; k < kTileTexels; ++k) {
      if (!(sum[k].weight > 0)) continue;
      mean[k] = sum[k].radiance * (1 / sum[k].weight);
      blur_[texel_of(k)] = sum[k].blur / sum[k].weight;
    }
  }
  std::array<float, kTileTexels> inverse_variance{};
  for (std::size_t k = 0; k < kTileTexels; ++k) {
    inverse_variance[k] = sigma[k] > 0 ? 1 / (sigma[k] * sigma[k]) : 0;
    TexelRadiance& texel = diffuse_[texel_of(k)];
    if (texel.seen()) texel = {mean[k].r, mean[k].g, mean[k].b, 0};
  }
  for (const Sample& s : samples_) {
    const Radiance specular = s.radiance - mean[s.k] + specular_.at(s.where);
    const float square = specular.luminance() * specular.luminance();
    for (std::size_t n = 0; n < 3; ++n) {
      const float weight = s.where.weight[n] * inverse_variance[s.k];
      next_.value[s.where.node[n]] += weight * specular;
      next_.weight[s.where.node[n]] += weight;
      next_.sigma[s.where.node[n]] += weight * square;
    }
  }
}

float ReflectanceSeparation::low_quantile(float Radiance::*channel) {
  // Nodes at the fringe of what was seen have few samples: only those count that have a tenth of the mean weight.
  double mean = 0;
  for (const float weight : next_.weight) mean += static_cast<double>(weight);
  const float least_weight = static_cast<float>(0.1 * mean / static_cast<double>(next_.weight.size()));
  of_nodes_.clear();
  for (std::size_t node = 0; node < next_.value.size(); ++node)
    if (next_.weight[node] > least_weight) of_nodes_.push_back(next_.value[node].*channel);
  return of_nodes_.empty() ? 0 : static_cast<float>(upper_quantile(of_nodes_, 0.02));
}

void ReflectanceSeparation::finish_sweep() {
  double sum = 0, nodes = 0;
  for (const float weight : next_.weight) sum += static_cast<double>(weight), nodes += weight > 0 ? 1 : 0;
  const auto least_weight = static_cast<float>(kMinRelativeWeight * sum / std::max(nodes, 1.0));
  for (std::size_t node = 0; node < next_.value.size(); ++node) {
    float& weight = next_.weight[node];
    if (!(weight > least_weight)) weight = 0;
    const float scale = weight > 0 ? 1 / weight : 0;
    next_.value[node] = next_.value[node] * scale;
    const float luminance = next_.value[node].luminance();
    next_.sigma[node] = std::sqrt(std::max(0.0F, next_.sigma[node] * scale - luminance * luminance));
  }
  const Radiance least{low_quantile(&Radiance::r), low_quantile(&Radiance::g), low_quantile(&Radiance::b)};
  for (std::size_t node = 0; node < next_.value.size(); ++node) {
    if (next_.weight[node] > 0) next_.value[node] = next_.value[node] - least;
  }
  for (TexelRadiance& texel : diffuse_)
    if (texel.seen()) texel.r += least.r, texel.g += least.g, texel.b += least.b;
  for (std::size_t node = 0; node < clipped_.size(); ++node) {
    const ClippedNode& c = clipped_[node];
    next_.clipped[node] = c.clipped > kMaxClippedShare * (c.clipped + c.measured) ? 1 : 0;
    Radiance& value = next_.value[node];
    const float mean = c.color.luminance();
    if (next_.clipped[node] == 0 || !(mean > 0) || c.bound < value.luminance()) continue;
    value = c.color * (c.bound / mean);
    next_.weight[node] += std::numeric_limits<float>::min();
  }
  fill_unseen(next_);
  std::swap(specular_, next_);
  std::fill(next_.value.begin(), next_.value.end(), Radiance{});
  std::fill(next_.weight.begin(), next_.weight.end(), 0.0F);
  std::fill(next_.sigma.begin(), next_.sigma.end(), 0.0F);
  ++sweeps_;
}

bool ReflectanceSeparation::sweep(const SurfaceLightField& light_field, std::size_t samples) {
  if (next_group_ == 0) {
    stride_ = 1;
    while (stride_ < kMaxStride && light_field.samples() / static_cast<std::size_t>(stride_) > kSweepSamples)
      stride_ *= 2;
    ++phase_;
  }
  return process(light_field, samples);
}

bool ReflectanceSeparation::process(const SurfaceLightField& light_field, std::size_t samples) {
  const int tiles = texels_.tiles() * texels_.tiles(), groups = (tiles + stride_ - 1) / stride_;
  for (std::size_t done = 0; done < samples; done += samples_.size() + kTileCost) {
    // One tile of each group of `stride_`, another one in every sweep; shifted from group to group.
    const int tile = next_group_ * stride_ + (phase_ + 7 * next_group_) % stride_;
    samples_.clear();
    if (tile < tiles) {
      gather(light_field, tile);
      update_tile(tile);
    }
    if (++next_group_ < groups) continue;
    next_group_ = 0;
    finish_sweep();
    return true;
  }
  return false;
}

void ReflectanceSeparation::solve(const SurfaceLightField& light_field, int sweeps) {
  constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
  if (next_group_ > 0) (void)process(light_field, kAll);
  stride_ = 1;
  for (int k = 0; k < sweeps; ++k) (void)process(light_field, kAll);
}

void ReflectanceSeparation::restart(float gain) {
  std::fill(medians_.begin(), medians_.end(), RunningMedian{});
  for (TexelRadiance& texel : diffuse_)
    if (texel.seen()) texel.r *= gain, texel.g *= gain, texel.b *= gain;
  specular_ = Lumisphere(specular_.grid.levels());
  next_ = specular_;
  std::fill(clipped_.begin(), clipped_.end(), ClippedNode{});
  next_group_ = 0;
}

void ReflectanceSeparation::sharpen(int iterations, TexelImage& out) const {
  out = diffuse_;
  const auto edge = static_cast<std::size_t>(texels_.edge);
  TexelImage blurred(out.size());
  for (int n = 0; n < iterations; ++n) {
    for (std::size_t j = 0; j < edge; ++j)
      for (std::size_t i = 0; i < edge; ++i) {
        const std::size_t at = j * edge + i;
        const TexelRadiance& c = out[at];
        // The kernel (v/2, 1 - v, v/2) along each axis has the variance v; beyond 0.6 it is no longer a blur.
        const float half = 0.5F * std::min(blur_[at] + kRegistrationVariance, 0.6F);
        blurred[at] = c;
        for (const std::size_t other :
             {i > 0 ? at - 1 : at, i + 1 < edge ? at + 1 : at, j > 0 ? at - edge : at, j + 1 < edge ? at + edge : at}) {
          const TexelRadiance& o = out[other].seen() ? out[other] : c;
          blurred[at].r += half * (o.r - c.r), blurred[at].g += half * (o.g - c.g), blurred[at].b += half * (o.b - c.b);
        }
      }
    for (std::size_t k = 0; k < out.size(); ++k) {
      out[k].r += diffuse_[k].r - blurred[k].r;
      out[k].g += diffuse_[k].g - blurred[k].g;
      out[k].b += diffuse_[k].b - blurred[k].b;
    }
  }
}

void ReflectanceSeparation::predict(Vec3d lens, TexelImage& out) const {
  out = diffuse_;
  if (sweeps_ == 0) return;
  // S at the corners of the tiles, bilinear between them: a tile is seen within a degree.
  const Vec3f eye = vec_cast<float>(lens);
  const int tiles = texels_.tiles();
  std::vector<Radiance> above(static_cast<std::size_t>(tiles + 1)), below(above.size());
  const auto fill = [&](int row, std::vector<Radiance>& corners) {
    for (int i = 0; i <= tiles; ++i)
      corners[static_cast<std::size_t>(i)] =
          specular_.at(eye - vec_cast<float>(texels_.point(i * kTileEdge, row * kTileEdge)));
  };
  fill(0, below);
  for (int j = 0; j < texels_.edge; ++j) {
    if (j % kTileEdge == 0) {
      std::swap(above, below);
      fill(j / kTileEdge + 1, below);
    }
    const float v = (static_cast<float>(j % kTileEdge) + 0.5F) / kTileEdge;
    for (int i = 0; i < texels_.edge; ++i) {
      TexelRadiance& texel = out[static_cast<std::size_t>(j * texels_.edge + i)];
      if (!texel.seen()) continue;
      const float u = (static_cast<float>(i % kTileEdge) + 0.5F) / kTileEdge;
      const auto left = static_cast<std::size_t>(i / kTileEdge), right = left + 1;
      const float w[4] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
      texel.r += w[0] * above[left].r + w[1] * above[right].r + w[2] * below[left].r + w[3] * below[right].r;
      texel.g += w[0] * above[left].g + w[1] * above[right].g + w[2] * below[left].g + w[3] * below[right].g;
      texel.b += w[0] * above[left].b + w[1] * above[right].b + w[2] * below[left].b + w[3] * below[right].b;
    }
  }
}

}  // namespace lightwell::specular
