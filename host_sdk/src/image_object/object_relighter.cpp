// Relights a view: equations 8 to 10 of the CyberMirage paper, on transform coefficients.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <lightwell/image_object.hpp>

#include "image_object/dct.hpp"
#include "image_object/light_arrangement.hpp"
#include "image_object/object_light.hpp"
#include "image_object/view_data.hpp"

namespace lightwell {
namespace {

using image_object::Coefficient;
using image_object::DecodedView;
using image_object::kBlock;
using image_object::kBlockPixels;
using image_object::LightPlanes;

/// Lights that are computed together, as the lanes of vectors.
constexpr std::size_t kLanes = 4;
using Lanes = std::array<float, kLanes>;

/// Largest square root of a relative luminance, and largest irradiance relative to the capture's: products of damaged
/// input stay finite.
constexpr float kMaxRoot = 1e3F, kMaxIrradianceRatio = 1e20F;

/// What a group of lights needs of a view.
struct LightGroup {
  std::vector<Lanes> luminance, highlight;  ///< Of each plane: the basis at each light.
  std::array<Lanes, 3> irradiance{};        ///< [channel][lane], relative to that of the capture.
};

/// Sum over planes of basis times levels, at each place of a block.
struct BlockSums {
  std::array<Lanes, kBlockPixels> value;
  std::uint32_t rows = 0;  ///< Bit y: a coefficient of row y is not zero.
};

void sum_planes(const LightPlanes& planes, std::size_t live, const std::vector<Lanes>& basis, BlockSums& sums) {
  for (Lanes& lanes : sums.value) lanes = {};
  sums.rows = 0;
  const Coefficient* const end = planes.coefficients.data() + planes.begin[live + 1];
  for (const Coefficient* c = planes.coefficients.data() + planes.begin[live]; c != end; ++c) {
    const Lanes& row = basis[c->where / kBlockPixels];
    const std::size_t place = c->where % kBlockPixels;
    const auto level = static_cast<float>(c->level);
    for (std::size_t lane = 0; lane < kLanes; ++lane) sums.value[place][lane] += level * row[lane];
    sums.rows |= 1U << (place / kBlock);
  }
}

/// The square of a root: of a luminance, which is not negative.
float squared(float root) { return root > 0 ? root * root : 0; }
/// The same of highlights: a colour more saturated than the base has a negative one.
float signed_square(float root) { return root * std::abs(root); }

/// The inverse transform: roots, scaled, and what `square` makes of them.
template <float (*square)(float)>
void transform(const BlockSums& sums, float scale, std::array<Lanes, kBlockPixels>& out) {
  const image_object::DctMatrix& m = image_object::dct_matrix();
  std::array<Lanes, kBlockPixels> rows;
  for (std::size_t k = 0; k < kBlock; ++k) {
    if ((sums.rows >> k & 1U) == 0) continue;
    for (std::size_t x = 0; x < kBlock; ++x) {
      Lanes sum{};
      for (std::size_t j = 0; j < kBlock; ++j)
        for (std::size_t lane = 0; lane < kLanes; ++lane) sum[lane] += m[j][x] * sums.value[k * kBlock + j][lane];
      rows[k * kBlock + x] = sum;
    }
  }
  for (std::size_t y = 0; y < kBlock; ++y)
    for (std::size_t x = 0; x < kBlock; ++x) {
      Lanes sum{};
      for (std::size_t k = 0; k < kBlock; ++k) {
        if ((sums.rows >> k & 1U) == 0) continue;
        for (std::size_t lane = 0; lane < kLanes; ++lane) sum[lane] += m[k][y] * rows[k * kBlock + x][lane];
      }
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        out[y * kBlock + x][lane] = square(std::clamp(scale * sum[lane], -kMaxRoot, kMaxRoot));
      }
    }
}

/// Factors of a block's pixels: of the base colour and of the second colour.
struct BlockLight {
  std::array<std::array<float, kBlockPixels>, 3> base, second;
};

void add_group(const DecodedView& view, std::size_t live, const LightGroup& group, BlockLight& light) {
  std::array<Lanes, kBlockPixels> luminance, highlight;
  BlockSums sums;
  sum_planes(view.luminance, live, group.luminance, sums);
  if (sums.rows == 0) return;
  transform<squared>(sums, view.luminance.step / view.gain[live], luminance);
  sum_planes(view.highlight, live, group.highlight, sums);
  const bool highlights = sums.rows != 0;
  if (highlights) {
    transform<signed_square>(sums, view.highlight.step / view.gain[live], highlight);
    for (std::size_t p = 0; p < kBlockPixels; ++p)
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        highlight[p][lane] = std::clamp(highlight[p][lane], -luminance[p][lane], luminance[p][lane]);
        luminance[p][lane] -= highlight[p][lane];
      }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const Lanes& e = group.irradiance[c];
    for (std::size_t p = 0; p < kBlockPixels; ++p)
      light.base[c][p] +=
          (luminance[p][0] * e[0] + luminance[p][1] * e[1]) + (luminance[p][2] * e[2] + luminance[p][3] * e[3]);
    if (highlights)
      for (std::size_t p = 0; p < kBlockPixels; ++p)
        light.second[c][p] +=
            (highlight[p][0] * e[0] + highlight[p][1] * e[1]) + (highlight[p][2] * e[2] + highlight[p][3] * e[3]);
  }
}

Status check(const ObjectLight& light, std::size_t index, float reference_irradiance) {
  if (const Status valid = image_object::check_light(light, index); !valid.ok()) return valid;
  const Irradiance& e = light.irradiance;
  if (!(std::max({e.r, e.g, e.b}) / reference_irradiance <= kMaxIrradianceRatio))
    return invalid_argument("light " + std::to_string(index) +
                            " has more than 1e20 times the irradiance of the capture");
  return {};
}

}  // namespace

class ObjectRelighter::Impl {
 public:
  RelightSummary prepare(const DecodedView& view, std::span<const ObjectLight> lights,
                         LightInterpolation interpolation) {
    RelightSummary summary;
    used_ = 0;
    std::size_t lane = kLanes;
    const Quat turn = Quat::about({0, 1, 0}, static_cast<double>(view.turn_rad));
    for (const ObjectLight& light : lights) {
      const Irradiance& e = light.irradiance;
      if (e.r == 0 && e.g == 0 && e.b == 0) continue;
      const Vec3d towards = rotate(turn, normalized(vec_cast<double>(light.direction)));
      const image_object::LightWeights weights = interpolation == LightInterpolation::nearest
                                                     ? image_object::nearest_light(view.directions, towards)
                                                     : image_object::smooth_lights(view.directions, towards);
      if (lane == kLanes) {
        add_group(view);
        lane = 0;
      }
      LightGroup& group = groups_[used_ - 1];
      for (std::size_t c = 0; c < 3; ++c)
        group.irradiance[c][lane] = e[static_cast<int>(c)] / view.reference_irradiance;
      set_lane(view.luminance, weights, view.directions.size(), lane, group.luminance);
      set_lane(view.highlight, weights, view.directions.size(), lane, group.highlight);
      ++lane;
      ++summary.lights;
      summary.outside_rad = std::max(summary.outside_rad, static_cast<float>(weights.outside_rad));
    }
    return summary;
  }

  void render(const DecodedView& view, std::span<Radiance> out) const {
    std::ranges::fill(out, Radiance{});
    BlockLight light;
    for (std::size_t live = 0; live < view.live.size(); ++live) {
      for (auto& channel : light.base) channel.fill(0);
      for (auto& channel : light.second) channel.fill(0);
      for (std::size_t g = 0; g < used_; ++g) lightwell::add_group(view, live, groups_[g], light);
      const image_object::BasePixel* const colours = view.base.data() + live * kBlockPixels;
      each_pixel(view, view.live[live], [&](std::size_t pixel, std::size_t p) {
        if (view.coverage[pixel] == 0) return;
        for (std::size_t c = 0; c < 3; ++c) {
          const int channel = static_cast<int>(c);
          out[pixel][channel] = std::max(
              0.0F, colours[p].base[channel] * light.base[c][p] + colours[p].second[channel] * light.second[c][p]);
        }
      });
    }
  }

 private:
  void add_group(const DecodedView& view) {
    if (used_ == groups_.size()) groups_.emplace_back();
    LightGroup& group = groups_[used_++];
    group.luminance.assign(view.luminance.planes, Lanes{});
    group.highlight.assign(view.highlight.planes, Lanes{});
    group.irradiance = {};
  }

  static void set_lane(const LightPlanes& planes, const image_object::LightWeights& weights, std::size_t lights,
                       std::size_t lane, std::vector<Lanes>& out) {
    for (std::size_t k = 0; k < planes.planes; ++k) {
      double sum = 0;
      for (std::size_t i = 0; i < weights.count; ++i)
        sum += weights.entries[i].weight * static_cast<double>(planes.basis[k * lights + weights.entries[i].light]);
      out[k][lane] = static_cast<float>(sum);
    }
  }

  std::vector<LightGroup> groups_;
  std::size_t used_ = 0;
};

ObjectRelighter::ObjectRelighter() : impl_(std::make_unique<Impl>()) {}
ObjectRelighter::ObjectRelighter(ObjectRelighter&&) noexcept = default;
ObjectRelighter& ObjectRelighter::operator=(ObjectRelighter&&) noexcept = default;
ObjectRelighter::~ObjectRelighter() = default;

Result<RelightSummary> ObjectRelighter::relight(const ObjectView& view, std::span<const ObjectLight> lights,
                                                LightInterpolation interpolation, std::span<Radiance> out) {
  const DecodedView& decoded = view.decoded();
  if (out.size() != decoded.coverage.size())
    return invalid_argument("the picture has " + std::to_string(out.size()) + " pixels, the view " +
                            std::to_string(decoded.coverage.size()));
  if (lights.size() > kMaxLights)
    return invalid_argument("there are " + std::to_string(lights.size()) + " lights: at most 1024 are allowed");
  for (std::size_t i = 0; i < lights.size(); ++i)
    if (const Status valid = check(lights[i], i, decoded.reference_irradiance); !valid.ok()) return valid;
  const RelightSummary summary = impl_->prepare(decoded, lights, interpolation);
  impl_->render(decoded, out);
  return summary;
}

}  // namespace lightwell
