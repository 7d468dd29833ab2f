#include "estimate/frames/row_reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "calibration/model/response.hpp"
#include "estimate/frames/block_layout.hpp"

namespace lightwell::estimate {
namespace {

/// Largest exposure_s * gain, and largest inverse: squares of larger values overflow floats.
constexpr double kMaxScale = 1e15;

std::uint16_t word(const std::byte* at) {
  return static_cast<std::uint16_t>(std::to_integer<unsigned>(at[0]) | std::to_integer<unsigned>(at[1]) << 8);
}

/// Float at an address that need not be aligned.
float float_at(const std::byte* at) {
  float v;
  std::memcpy(&v, at, sizeof v);
  return v;
}

Status format_mismatch(const std::string& what) { return invalid_argument("frame: " + what); }

}  // namespace

LinearRow::LinearRow(int width) {
  const auto n = static_cast<std::size_t>(width);
  r.resize(n), g.resize(n), b.resize(n), variance.resize(n), bias.resize(n), clipped.resize(n);
}

RowReader::CodeTable::CodeTable(const PhotometricCalibration& photometry, int levels)
    : linear(linear_table(photometry, levels)), step(linear.size()) {
  for (std::size_t i = 0; i < step.size(); ++i) step[i] = i > 0 ? linear[i] - linear[i - 1] : linear[1] - linear[0];
  saturated_from = lightwell::saturated_from(photometry, levels);
}

RowReader::RowReader(const RigParameters& rig, const RigTable* table) : rig_(rig), table_(table) {
  std::size_t max_width = 0;
  for (const LensParameters& lens : rig.lenses) {
    if (table == nullptr) vignetting_.emplace_back(lens);
    std::vector<CodeTable>& tables = tables_.emplace_back();
    for (const int bits : kCodeBits) tables.emplace_back(lens.photometry, 1 << bits);
    max_width = std::max(max_width, static_cast<std::size_t>(lens.width));
  }
  for (auto& x : x_) x.resize(max_width);
  step_.resize(max_width);
  saturated_.resize(max_width);
  weight_.resize(max_width);
  ones_.assign(max_width, 1.0F);
}

Status RowReader::bind(std::span<const Frame> bracket) {
  if (bracket.empty() || bracket.size() > kMaxBracket) return format_mismatch("a bracket has 1 to 8 exposures");
  exposure_count_ = 0;
  layout_ = nullptr;
  for (const Frame& frame : bracket) {
    if (frame.views().empty() || frame.views().size() > rig_.lenses.size())
      return format_mismatch("it has " + std::to_string(frame.views().size()) + " views, the calibration " +
                             std::to_string(rig_.lenses.size()) + " lenses");
    Exposure& e = exposures_[exposure_count_++];
    unsigned lenses = 0;
    for (const View& v : frame.views()) {
      if (v.lens < 0 || static_cast<std::size_t>(v.lens) >= rig_.lenses.size())
        return format_mismatch("lens " + std::to_string(v.lens) + " is not in the calibration");
      const LensParameters& lens = rig_.lenses[static_cast<std::size_t>(v.lens)];
      if (v.width != lens.width || v.height != lens.height)
        return format_mismatch("lens " + std::to_string(v.lens) + " gives " + std::to_string(v.width) + "x" +
                               std::to_string(v.height) + " pixels, its calibration is for " +
                               std::to_string(lens.width) + "x" + std::to_string(lens.height));
      if (const Status s = check_view(v); !s.ok())
        return format_mismatch("lens " + std::to_string(v.lens) + ": " + s.message());
      if ((lenses >> v.lens & 1U) != 0) return format_mismatch("it contains the same lens twice");
      lenses |= 1U << v.lens;
      e.view[static_cast<std::size_t>(v.lens)] = v;
    }
    if (exposure_count_ > 1 && lenses != present_lenses_)
      return format_mismatch("the exposures of a bracket contain different lenses");
    present_lenses_ = lenses;
    const double exposure = frame.info.exposure_s * frame.info.gain;
    if (!(exposure > 0) || !std::isfinite(exposure))
      return format_mismatch("exposure_s * gain is " + std::to_string(exposure) + "; it must be positive and finite");
    if (!(exposure >= 1 / kMaxScale && exposure <= kMaxScale))
      return format_mismatch("exposure_s * gain is " + std::to_string(exposure) + "; it must be from 1e-15 to 1e15");
    e.radiance_per_linear = static_cast<float>(1 / exposure);
  }
  std::sort(exposures_.begin(), exposures_.begin() + static_cast<std::ptrdiff_t>(exposure_count_),
            [](const Exposure& a, const Exposure& b) { return a.radiance_per_linear > b.radiance_per_linear; });
  return {};
}

void RowReader::limit_exposures_per_block(const BlockLayout& layout, std::span<const std::uint8_t> exposures) {
  layout_ = &layout;
  exposures_per_block_ = exposures;
}

void RowReader::load(const View& view, int y, int first, int end, SaturationHandling saturation) {
  const auto n = static_cast<std::size_t>(end - first);
  const PixelLayout& layout = pixel_layout(view.format);
  const CodeTable& table = tables_[static_cast<std::size_t>(view.lens)][layout.depth_index()];
  const auto row = [&view](int j) { return view.data.data() + static_cast<std::size_t>(j) * view.stride; };
  float* __restrict x0 = x_[0].data();
  float* __restrict x1 = x_[1].data();
  float* __restrict x2 = x_[2].data();
  float* __restrict steps = step_.data();
  std::uint8_t* __restrict saturated = saturated_.data();
  const auto put_code = [&](std::size_t i, unsigned r, unsigned g, unsigned b) {
    x0[i] = table.linear[r];
    x1[i] = table.linear[g];
    x2[i] = table.linear[b];
    if (saturation == SaturationHandling::none) return;
    const unsigned top = std::max({r, g, b});
    saturated[i] = top >= table.saturated_from ? 1 : 0;
    steps[i] = table.step[top];
  };
  const auto put_ycbcr = [&](std::size_t i, std::byte luma, std::byte max_luma, std::byte cb, std::byte cr) {
    const std::array<std::uint8_t, 3> v =
        rgb8_of_ycbcr601(std::to_integer<int>(luma), std::to_integer<int>(cb), std::to_integer<int>(cr));
    put_code(i, v[0], v[1], v[2]);
    if (saturation != SaturationHandling::shared) return;
    // Of the pixels that share chroma, the one with the largest luma has the largest codes.
    const std::array<std::uint8_t, 3> most =
        rgb8_of_ycbcr601(std::to_integer<int>(max_luma), std::to_integer<int>(cb), std::to_integer<int>(cr));
    saturated[i] = std::max({most[0], most[1], most[2]}) >= table.saturated_from ? 1 : 0;
  };
  switch (view.format) {
    case PixelFormat::rgb8: {
      const std::byte* at = row(y) + 3 * static_cast<std::size_t>(first);
      for (std::size_t i = 0; i < n; ++i, at += 3)
        put_code(i, std::to_integer<unsigned>(at[0]), std::to_integer<unsigned>(at[1]),
                 std::to_integer<unsigned>(at[2]));
      return;
    }
    case PixelFormat::nv12: {
      const std::byte* luma = row(y);
      const std::byte* upper = row(y & ~1);
      const std::byte* lower = row(y | 1);
      const std::byte* chroma = row(view.height + y / 2);
      for (std::size_t i = 0; i < n; ++i) {
        const std::size_t x = static_cast<std::size_t>(first) + i;
        const std::size_t left = x & ~std::size_t{1};
        put_ycbcr(i, luma[x], std::max({upper[left], upper[left + 1], lower[left], lower[left + 1]}), chroma[left],
                  chroma[left + 1]);
      }
      return;
    }
    case PixelFormat::yuyv: {
      const std::byte* at = row(y);
      for (std::size_t i = 0; i < n; ++i) {
        const std::size_t x = static_cast<std::size_t>(first) + i, pair = x / 2 * 4;
        put_ycbcr(i, at[2 * x], std::max(at[pair], at[pair + 2]), at[pair + 1], at[pair + 3]);
      }
      return;
    }
    case PixelFormat::bayer_rggb8:
    case PixelFormat::bayer_rggb10:
    case PixelFormat::bayer_rggb12: {
      // Each pixel has the colour of its 2x2 quad (no interpolation), so that the energy of a quad is exact.
      const bool bytes = layout.sample_bytes == 1;
      const auto top = static_cast<unsigned>(layout.full_scale());
      const std::byte* upper = row(y & ~1);
      const std::byte* lower = row(y | 1);
      for (std::size_t i = 0; i < n; ++i) {
        const std::size_t x = (static_cast<std::size_t>(first) + i) & ~std::size_t{1};
        const auto site = [&](const std::byte* row_at, std::size_t column) {
          return bytes ? std::to_integer<unsigned>(row_at[column]) : std::min<unsigned>(word(row_at + 2 * column), top);
        };
        const unsigned red = site(upper, x), green1 = site(upper, x + 1);
        const unsigned green2 = site(lower, x), blue = site(lower, x + 1);
        put_code(i, red, std::max(green1, green2), blue);
        x1[i] = 0.5F * (table.linear[green1] + table.linear[green2]);
      }
      return;
    }
    case PixelFormat::rgb_f32: {
      const std::byte* at = row(y) + 12 * static_cast<std::size_t>(first);
      for (std::size_t i = 0; i < n; ++i, at += 12) {
        x0[i] = float_at(at);
        x1[i] = float_at(at + 4);
        x2[i] = float_at(at + 8);
      }
      std::fill_n(saturated_.begin(), n, std::uint8_t{0});
      std::fill_n(step_.begin(), n, 0.0F);
      return;
    }
  }
}

float near_black_bias(float x, float step, float cut_noise) {
  // Rounding errors average out where values or noise spread over several codes; otherwise all pixels may have the same
  // error of half a step. Cutting off Gaussian noise at zero adds up to sigma / sqrt(2 pi) = 0.4 sigma.
  const float rounding = x < 4 * step && cut_noise < step ? 0.5F * step : 0;
  const float cut = x < 2 * cut_noise ? 0.4F * cut_noise : 0;
  return rounding + cut;
}

const std::byte* RowReader::floats(int lens, int y, int first) const {
  const View& view = exposures_[0].view[static_cast<std::size_t>(lens)];
  if (exposure_count_ != 1 || !pixel_layout(view.format).is_float()) return nullptr;
  return view.data.data() + static_cast<std::size_t>(y) * view.stride + 12 * static_cast<std::size_t>(first);
}

const float* RowReader::inverse_vignetting_of(std::size_t lens, int y, int first, int end) {
  if (table_ == nullptr) return vignetting_[lens].inverse(y, first, end);
  const LensTable& table = table_->lenses[lens];
  return table.inverse_vignetting.data() + table.index(first, y);
}

void RowReader::read(int lens, int y, int first, int end, Reading what, LinearRow& out, ReadStatistics& counts) {
  const auto n = static_cast<std::size_t>(end - first);
  const auto at = static_cast<std::size_t>(lens);
  const PhotometricCalibration& photometry = rig_.lenses[at].photometry;
  // Floats are radiance: vignetting, response and white balance have been corrected.
  const bool is_radiance = pixel_layout(exposures_[0].view[at].format).is_float();
  const std::size_t exposures =
      layout_ == nullptr ? exposure_count_ : exposures_per_block_[layout_->block_of(lens, first, y)];
  const float* inverse_vignetting = is_radiance ? ones_.data() : inverse_vignetting_of(at, y, first, end);
  const auto noise = [&](double v) { return is_radiance ? 0.0F : static_cast<float>(v); };
  const float read2 = noise(photometry.read_noise * photometry.read_noise), shot = noise(photometry.shot_noise);
  // With a black level, noise below black is kept and averages out.
  const float cut_noise = photometry.black_level < 2 * photometry.read_noise ? noise(photometry.read_noise) : 0.0F;
  float white[3];
  for (std::size_t c = 0; c < 3; ++c) white[c] = is_radiance ? 1.0F : static_cast<float>(photometry.white_balance[c]);
  float* radiance[3] = {out.r.data(), out.g.data(), out.b.data()};
  out.certain = false;

  if (exposures == 1 && is_radiance) {
    // Single float frame: no lookup tables, no error estimates.
    const float k = scale_of_floats();
    const std::byte* in = floats(lens, y, first);
    float* __restrict r = out.r.data();
    float* __restrict g = out.g.data();
    float* __restrict b = out.b.data();
    for (std::size_t i = 0; i < n; ++i, in += 12) {
      r[i] = float_at(in) * k;
      g[i] = float_at(in + 4) * k;
      b[i] = float_at(in + 8) * k;
    }
    out.certain = true;
  } else if (exposures == 1) {
    const Exposure& e = exposures_[0];
    load(e.view[at], y, first, end,
         what == Reading::radiance ? SaturationHandling::none
         : exposure_count_ > 1     ? SaturationHandling::shared
                                   : SaturationHandling::own);
    const float k = e.radiance_per_linear;
    // One loop over the three channels, because runs are short.
    const float* __restrict x0 = x_[0].data();
    const float* __restrict x1 = x_[1].data();
    const float* __restrict x2 = x_[2].data();
    const float* __restrict vignetting_scale = inverse_vignetting;
    float* __restrict r = out.r.data();
    float* __restrict g = out.g.data();
    float* __restrict b = out.b.data();
    const float kr = k * white[0], kg = k * white[1], kb = k * white[2];
    for (std::size_t i = 0; i < n; ++i) {
      r[i] = x0[i] * kr * vignetting_scale[i];
      g[i] = x1[i] * kg * vignetting_scale[i];
      b[i] = x2[i] * kb * vignetting_scale[i];
    }
    if (what == Reading::radiance) return;
    std::copy_n(saturated_.begin(), n, out.clipped.begin());
    if (what == Reading::with_clipped) return;
    const float* __restrict green = x_[1].data();
    const float* __restrict step = step_.data();
    float* __restrict variance = out.variance.data();
    for (std::size_t i = 0; i < n; ++i) {
      const float v = read2 + shot * (green[i] > 0 ? green[i] : 0) + step[i] * step[i] * (1.0F / 12);
      variance[i] = v * (k * inverse_vignetting[i]) * (k * inverse_vignetting[i]);
      out.bias[i] = near_black_bias(green[i], step[i], cut_noise) * k * inverse_vignetting[i];
    }
  } else {
    for (int c = 0; c < 3; ++c) std::fill_n(radiance[c], n, 0.0F);
    std::fill_n(weight_.begin(), n, 0.0F);
    std::fill_n(out.bias.begin(), n, 0.0F);
    std::fill_n(out.clipped.begin(), n, std::uint8_t{1});
    for (std::size_t k = 0; k < exposures; ++k) {
      const Exposure& e = exposures_[k];
      load(e.view[at], y, first, end, SaturationHandling::shared);
      const float scale = e.radiance_per_linear;
      for (std::size_t i = 0; i < n; ++i) {
        if (saturated_[i] != 0) {
          // A lower bound, used where every exposure is saturated; that of the shortest exposure is the highest.
          if (out.clipped[i] != 0)
            for (int c = 0; c < 3; ++c) radiance[c][i] = std::max(radiance[c][i], x_[c][i] * scale);
          continue;
        }
        if (out.clipped[i] != 0) {
          out.clipped[i] = 0;
          for (int c = 0; c < 3; ++c) radiance[c][i] = 0;
        }
        // The three channels share one weight, by the brightest, so that merging does not change the colour. 1e-12
        // keeps the weight finite for a camera without a noise model; the variances of linear values are then equal.
        const float x = std::max({x_[0][i], x_[1][i], x_[2][i], 0.0F});
        const float v = read2 + shot * x + step_[i] * step_[i] * (1.0F / 12) + 1e-12F;
        const float w = 1 / (v * scale * scale);
        weight_[i] += w;
        out.bias[i] += w * near_black_bias(x_[1][i], step_[i], cut_noise) * scale;
        for (int c = 0; c < 3; ++c) radiance[c][i] += w * x_[c][i] * scale;
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      const float normal = out.clipped[i] != 0 ? 1 : 1 / weight_[i];
      out.variance[i] = out.clipped[i] != 0 ? 0 : normal * inverse_vignetting[i] * inverse_vignetting[i];
      out.bias[i] *= normal * inverse_vignetting[i];
      for (int c = 0; c < 3; ++c) radiance[c][i] *= normal * white[c] * inverse_vignetting[i];
    }
  }

  // Only floats can be invalid. Negative values of an integer sensor are noise: cutting them off would cause a bias.
  if (!is_radiance) return;
  int invalid = 0;
  for (const float* channel : radiance)
    for (std::size_t i = 0; i < n; ++i)
      invalid += static_cast<int>(!(channel[i] >= 0)) + static_cast<int>(channel[i] > kMaxRadiance);
  if (invalid == 0) return;
  if (out.certain) {
    std::fill_n(out.variance.begin(), n, 0.0F);
    std::fill_n(out.bias.begin(), n, 0.0F);
    std::fill_n(out.clipped.begin(), n, std::uint8_t{0});
    out.certain = false;
  }
  float largest = 0;
  for (int c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < n; ++i)
      if (radiance[c][i] <= kMaxRadiance) largest = std::max(largest, radiance[c][i]);
  for (std::size_t i = 0; i < n; ++i) {
    bool replaced = false;
    for (int c = 0; c < 3; ++c) {
      float& v = radiance[c][i];
      if (v >= 0 && v <= kMaxRadiance) continue;
      replaced = true;
      // Infinite radiance is replaced by a lower bound: the largest finite value of the run.
      out.clipped[i] = v > kMaxRadiance ? 1 : out.clipped[i];
      v = v > kMaxRadiance ? largest : 0;
    }
    if (replaced) {
      ++counts.invalid_pixels;
      if (!std::isfinite(out.variance[i])) out.variance[i] = 0;
    }
  }
}

}  // namespace lightwell::estimate
