// Compression of a view: Karhunen-Loeve transform over the light positions, cosine transform over the pixels.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include <Eigen/Eigenvalues>

#include <lightwell/image_object_encoder.hpp>

#include "image_object/dct.hpp"
#include "image_object/view_codec.hpp"

namespace lightwell {
namespace {

using image_object::BlockLevels;
using image_object::BlockValues;
using image_object::DecodedView;
using image_object::kBlockPixels;
using image_object::LightPlanes;

/// Share of a step that is added before a level is rounded down (0.5: nearest). Smaller levels cost fewer bits than the
/// error that they cause.
constexpr float kRounding = 0.36F, kBaseRounding = 0.42F;
/// Planes with larger levels have a basis of 16 bits: half a code of 8 bits would change them by a quarter of a step.
constexpr int kMaxCoarseLevel = 64;
/// Error, in steps, that is worth a second colour other than white.
constexpr float kSecondTolerance = 0.5F;
constexpr float kMaxStep = 1, kMinStep = 0.0005F;

/// Levels of a block, of steps of that size.
BlockLevels quantize(const BlockValues& values, float step, float rounding) {
  BlockLevels out;
  for (std::size_t z = 0; z < kBlockPixels; ++z) {
    const float v = values[image_object::kZigzag[z]];
    const float level = std::floor(std::abs(v) / step + rounding);
    out.level[z] =
        static_cast<std::int32_t>(std::copysign(std::min(level, static_cast<float>(image_object::kMaxLevel)), v));
    if (out.level[z] != 0) out.count = static_cast<int>(z) + 1;
  }
  return out;
}

/// Replaces values where the object is not by the mean of the others, which costs few coefficients.
void fill_uncovered(const std::array<bool, kBlockPixels>& covered, std::span<float, kBlockPixels> values) {
  float sum = 0, n = 0;
  for (std::size_t i = 0; i < kBlockPixels; ++i)
    if (covered[i]) {
      sum += values[i];
      ++n;
    }
  for (std::size_t i = 0; i < kBlockPixels; ++i)
    if (!covered[i]) values[i] = n > 0 ? sum / n : 0;
}

std::array<bool, kBlockPixels> covered_pixels(const DecodedView& view, std::uint32_t block) {
  std::array<bool, kBlockPixels> out{};
  each_pixel(view, block, [&](std::size_t pixel, std::size_t place) { out[place] = view.coverage[pixel] != 0; });
  return out;
}

/// Fills the base's levels and what a reader makes of them.
void encode_base(const ViewFactors& factors, image_object::QuantizedView& out) {
  const std::vector<Radiance>& base = factors.base;
  DecodedView& view = out.layout;
  view.base.resize(view.live.size() * kBlockPixels);
  for (std::size_t i = 0; i < view.live.size(); ++i) {
    image_object::BasePlanes planes{};
    each_pixel(view, view.live[i], [&](std::size_t pixel, std::size_t place) {
      const float r = std::sqrt(base[pixel].r), g = std::sqrt(base[pixel].g), b = std::sqrt(base[pixel].b);
      planes[0][place] = 0.25F * r + 0.5F * g + 0.25F * b;
      planes[1][place] = 0.5F * (r - b);
      planes[2][place] = 0.5F * g - 0.25F * (r + b);
      planes[3][place] = factors.second[pixel].r - 1;
      planes[4][place] = factors.second[pixel].b - 1;
    });
    const auto covered = covered_pixels(view, view.live[i]);
    for (std::size_t k = 0; k < image_object::kBasePlanes; ++k) {
      fill_uncovered(covered, planes[k]);
      const float step = out.base_step * image_object::kBaseSteps[k];
      out.base.push_back(quantize(image_object::forward_dct(planes[k]), step, kBaseRounding));
      BlockValues values{};
      for (std::size_t z = 0; z < kBlockPixels; ++z)
        values[image_object::kZigzag[z]] = step * static_cast<float>(out.base.back().level[z]);
      planes[k] = image_object::inverse_dct(values);
    }
    const std::span<image_object::BasePixel, kBlockPixels> pixels(view.base.data() + i * kBlockPixels, kBlockPixels);
    base_pixels(planes, pixels);
    view.gain.push_back(gain_of(view, view.live[i], pixels));
  }
}

/// Eigenvectors of the covariance of the lights' square roots, weighted by base luminance, the largest first.
LightPlanes find_basis(const DecodedView& view, const std::vector<Radiance>& base,
                       const std::vector<std::vector<float>>& roots) {
  const auto lights = static_cast<Eigen::Index>(roots.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(lights, lights);
  // A few thousand pixels at a time.
  constexpr std::size_t kChunk = 4096;
  std::vector<std::size_t> pixels;
  for (std::size_t i = 0; i < view.coverage.size(); ++i)
    if (view.coverage[i] != 0) pixels.push_back(i);
  for (std::size_t from = 0; from < pixels.size(); from += kChunk) {
    const std::size_t n = std::min(kChunk, pixels.size() - from);
    Eigen::MatrixXf part(lights, static_cast<Eigen::Index>(n));
    for (std::size_t j = 0; j < n; ++j) {
      const std::size_t pixel = pixels[from + j];
      const float weight = std::sqrt(base[pixel].luminance());
      for (Eigen::Index l = 0; l < lights; ++l)
        part(l, static_cast<Eigen::Index>(j)) = weight * roots[static_cast<std::size_t>(l)][pixel];
    }
    covariance += (part * part.transpose()).cast<double>();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  LightPlanes out;
  out.planes = roots.size();
  out.basis.resize(out.planes * out.planes);
  for (Eigen::Index k = 0; k < lights; ++k)
    for (Eigen::Index l = 0; l < lights; ++l)
      out.basis[static_cast<std::size_t>(k * lights + l)] =
          static_cast<float>(solver.eigenvectors()(l, lights - 1 - k));
  return out;
}

/// The planes of one luminance that have a level, and their levels.
LightPlanes encode_luminance(const DecodedView& view, const std::vector<Radiance>& base,
                             std::vector<std::vector<float>> roots, float step, std::vector<BlockLevels>& levels) {
  for (auto& picture : roots)
    for (float& v : picture) v = std::copysign(std::sqrt(std::abs(v)), v);
  LightPlanes all = find_basis(view, base, roots);
  all.step = step;
  const std::size_t lights = roots.size();
  std::vector<BlockLevels> found(view.live.size() * lights);
  std::vector<int> largest(lights);
  std::vector<std::array<float, kBlockPixels>> values(lights);
  for (std::size_t i = 0; i < view.live.size(); ++i) {
    const auto covered = covered_pixels(view, view.live[i]);
    for (std::size_t l = 0; l < lights; ++l) {
      values[l].fill(0);
      each_pixel(view, view.live[i], [&](std::size_t pixel, std::size_t place) { values[l][place] = roots[l][pixel]; });
      fill_uncovered(covered, values[l]);
    }
    for (std::size_t k = 0; k < lights; ++k) {
      BlockValues plane{};
      for (std::size_t l = 0; l < lights; ++l)
        for (std::size_t p = 0; p < kBlockPixels; ++p) plane[p] += all.basis[k * lights + l] * values[l][p];
      BlockLevels& block = found[i * lights + k];
      block = quantize(image_object::forward_dct(plane), step / view.gain[i], kRounding);
      for (const std::int32_t level : block.level) largest[k] = std::max(largest[k], std::abs(level));
    }
  }
  LightPlanes out;
  out.step = step;
  std::vector<std::size_t> kept;
  for (std::size_t k = 0; k < lights; ++k)
    if (largest[k] > 0) kept.push_back(k);
  out.planes = kept.size();
  for (const std::size_t k : kept)
    out.basis.insert(out.basis.end(), all.basis.begin() + static_cast<std::ptrdiff_t>(k * lights),
                     all.basis.begin() + static_cast<std::ptrdiff_t>((k + 1) * lights));
  for (const std::size_t k : kept) out.precise.push_back(largest[k] > kMaxCoarseLevel);
  round_basis(out, lights);
  levels.clear();
  levels.reserve(view.live.size() * kept.size());
  for (std::size_t i = 0; i < view.live.size(); ++i)
    for (const std::size_t k : kept) levels.push_back(found[i * lights + k]);
  return out;
}

Status check_step(const char* name, float step) {
  if (step >= kMinStep && step <= kMaxStep) return {};
  return invalid_argument(std::string("ObjectEncoderOptions::") + name + " is " + std::to_string(step) +
                          ": it must be 0.0005 to 1");
}

}  // namespace

Status ObjectEncoderOptions::validate() const {
  if (const Status valid = check_step("luminance_step", luminance_step); !valid.ok()) return valid;
  if (highlight_step != 0)
    if (const Status valid = check_step("highlight_step", highlight_step); !valid.ok()) return valid;
  return check_step("base_step", base_step);
}

Result<std::string> encode_view(const ObjectRig& rig, const ViewPictures& pictures,
                                const ObjectEncoderOptions& options) {
  if (const Status valid = options.validate(); !valid.ok()) return valid;
  const bool highlights = options.highlight_step > 0;
  Result<ViewFactors> factors = factor_view(rig, pictures, highlights ? BaseColor::highlights : BaseColor::ambient,
                                            kSecondTolerance * options.luminance_step);
  if (!factors.ok()) return factors.status();
  image_object::QuantizedView view;
  set_size(view.layout, rig.columns, rig.rows);
  view.layout.directions = rig.light_positions;
  view.layout.coverage.assign(pictures.coverage.begin(), pictures.coverage.end());
  find_live_blocks(view.layout);
  view.base_step = options.base_step;
  encode_base(*factors, view);
  view.luminance = encode_luminance(view.layout, factors->base, std::move(factors->luminance), options.luminance_step,
                                    view.luminance_levels);
  if (highlights)
    view.highlight = encode_luminance(view.layout, factors->base, std::move(factors->highlight), options.highlight_step,
                                      view.highlight_levels);
  return write_view(view);
}

}  // namespace lightwell
