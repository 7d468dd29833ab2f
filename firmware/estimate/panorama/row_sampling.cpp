#include "estimate/panorama/row_sampling.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <lightwell/pixel.hpp>

#include "calibration/model/response.hpp"

namespace lightwell::estimate {
namespace {

/// Blocks of fewer rows are read whole: of one exposure, whose blocks of 8 rows are decoded in the time of their scan,
/// and of brackets.
constexpr int kMinEdge = 16, kMinBracketEdge = 8;
/// A correction that is further from 1 is unsure, and limited.
constexpr float kSureCorrection = 0.1F, kLargestCorrection = 0.5F;
/// The correction assumes one colour, and f at the mean code: so much of it may be wrong.
constexpr float kCorrectionError = 0.25F;
/// Rows of the brightest sample that may have been missed. In a room with fine structure (row_sampling_test), the error
/// is up to half of what one row would make it.
constexpr float kMissedRows = 0.5F;
/// Part of a correction that may be wrong with the same sign in all blocks: rows that alternate between two codes, one
/// of which is read more often.
constexpr float kCommonError = 0.1F;
/// The same for the squares of the corrections: a ratio of means has a bias of second order (Cochran 1977, chapter 6).
constexpr float kBias = 0.5F;
/// Where the sum of these over all blocks is more than this times the limit of a block, all rows are read.
constexpr double kMaxCommon = 40;
/// Noise makes the brightest of a block's samples brighter by so many standard deviations.
constexpr float kPeakNoiseSigmas = 4;
/// The raw samples of a bracket are those of the longest exposure in which the block's mean is at most this linear
/// value, and no sample is saturated.
constexpr float kWellExposed = 0.25F;
/// A correction that is unsure may be wrong by so much more.
constexpr float kUnsureFactor = 4;
/// Luma of 16 to 235 to codes of 0 to 255, without the rounding of rgb8_of_ycbcr601(): means of luma are no integers.
constexpr int kBlackLuma = 16;
constexpr float kCodesOfLuma = 255.0F / 219;

/// Linear value at a code between two entries of the table; `code` is not negative.
float interpolate(const std::vector<float>& linear, float code) {
  const auto i = std::min(static_cast<std::size_t>(code), linear.size() - 2);
  return linear[i] + (linear[i + 1] - linear[i]) * (code - static_cast<float>(i));
}

/// `unit`: rows that are decoded at once. `units`: of these that are read.
SampledRows rows_of(int edge, int unit, int units) {
  SampledRows rows{.unit = unit, .units = units};
  const auto whole_units = [unit](int n) { return n / unit * unit; };
  rows.step = whole_units((edge + rows.units - 1) / rows.units);
  rows.offset = whole_units((edge - unit - rows.step * (rows.units - 1)) / 2);
  return rows;
}

/// By block: its flag, inverted if `flip` is 1, where it is read.
void select(std::span<const std::uint8_t> flags, std::uint8_t flip, std::span<const std::uint8_t> read,
            std::span<std::uint8_t> out) {
  for (std::size_t block = 0; block < out.size(); ++block)
    out[block] = static_cast<std::uint8_t>((flags[block] ^ flip) & read[block]);
}

}  // namespace

RowSampling::RowSampling(const RigParameters& rig, const RigTable& table, const BlockLayout& layout,
                         const CodeWeights& weights)
    : layout_(layout),
      plane_(layout.size()),
      others_(layout.size(), 1),
      sampled_(layout.size()),
      whole_(layout.size()) {
  if (layout.edge() < kMinBracketEdge || layout.edge() > kMaxRows) return;
  for (std::size_t block = 0; block < layout.size(); ++block) {
    const BlockLayout::Place& place = layout.place(block);
    const bool plane = *weights.block_weights(block, Lanes::interleaved).mean > 0;
    if (!plane || place.width != layout.edge() || place.height != layout.edge()) continue;
    plane_[block] = 1;
    others_[block] = 0;
    any_ = true;
  }
  single_.rows = rows_of(layout.edge(), 1, 3);
  pairs_.rows = rows_of(layout.edge(), 2, 2);
  bracket_.rows = rows_of(layout.edge(), 1, 2);
  for (Reading* reading : {&single_, &pairs_, &bracket_}) plan(table, weights, *reading);
  for (const LensParameters& lens : rig.lenses) {
    const PhotometricCalibration& photometry = lens.photometry;
    Lens& out = lenses_.emplace_back();
    linear_ = linear_ && photometry.response.kind == ResponseCurve::Kind::linear;
    for (std::size_t k = 0; k < kCodeBits.size(); ++k) {
      out.linear[k] = linear_table(photometry, 1 << kCodeBits[k]);
      out.saturated_from[k] = saturated_from(photometry, 1 << kCodeBits[k]);
    }
    for (int luma = 0; luma < 256; ++luma)
      out.luma.push_back(
          interpolate(out.linear[0], std::clamp(static_cast<float>(luma - kBlackLuma) * kCodesOfLuma, 0.0F, 255.0F)));
    for (std::size_t c = 0; c < 3; ++c) out.inverse_white[c] = static_cast<float>(1 / photometry.white_balance[c]);
    out.largest_white = static_cast<float>(*std::ranges::max_element(photometry.white_balance));
  }
}

void RowSampling::plan(const RigTable& table, const CodeWeights& weights, Reading& out) const {
  const int edge = layout_.edge();
  out.blocks.resize(layout_.size());
  out.count = static_cast<float>(out.rows.count(edge));
  out.gradient = static_cast<float>(statistics_of({}, edge).variance / statistics_of(out.rows, edge).variance);
  for (std::size_t block = 0; block < layout_.size(); ++block) {
    if (plane_[block] == 0) continue;
    const BlockLayout::Place& place = layout_.place(block);
    const LensTable& lens = table.lenses[static_cast<std::size_t>(place.lens)];
    double sr = 0, moment = 0;
    for (int k = 0; k < out.rows.count(edge); ++k)
      for (int x = 0; x < place.width; ++x) {
        const double a = lens.solid_angle[lens.index(place.x + x, place.y + out.rows.row(k))];
        sr += a;
        moment += a * out.rows.row(k);
      }
    const BlockWeights of_block = weights.block_weights(block, Lanes::interleaved);
    const float solid_angle = *of_block.solid_angle;
    out.blocks[block] = {solid_angle, *of_block.inverse_vignetting,
                         static_cast<float>(static_cast<double>(solid_angle) / sr),
                         static_cast<float>(moment / sr) - layout_.middle(block).y};
  }
}

bool RowSampling::supports(const RowReader& reader) const {
  const PixelLayout& layout = reader.layout();
  if (!any_ || layout.is_float()) return false;
  // The sums of linear codes of one exposure are those of light, and cost as much as a scan.
  const bool light = linear_ && layout.sampling != ColorSampling::ycbcr;
  if (reader.exposures().size() == 1 && (layout_.edge() < kMinEdge || light)) return false;
  for (const RowReader::Exposure& exposure : reader.exposures())
    for (std::size_t lens = 0; lens < lenses_.size(); ++lens)
      if (reader.has(static_cast<int>(lens)) && exposure.view[lens].format != layout.format) return false;
  return true;
}

const RowSampling::Reading& RowSampling::reading_of(const RowReader& reader) const {
  const PixelFormat format = reader.layout().format;
  if (is_bayer(format)) return pairs_;
  if (reader.exposures().size() > 1) return bracket_;
  return format == PixelFormat::nv12 ? pairs_ : single_;
}

std::span<const std::uint8_t> RowSampling::sampled(std::span<const std::uint8_t> read) {
  if (read.empty()) return plane_;
  select(plane_, 0, read, sampled_);
  return sampled_;
}

std::span<const std::uint8_t> RowSampling::others(std::span<const std::uint8_t> read) {
  if (read.empty()) return others_;
  select(plane_, 1, read, whole_);
  return whole_;
}

RowSampling::Scan RowSampling::scan(const View& view, const BlockLayout::Place& place, const Reading& reading) const {
  const PixelLayout& layout = pixel_layout(view.format);
  const Lens& lens = lenses_[static_cast<std::size_t>(place.lens)];
  const int edge = layout_.edge();
  const auto width = static_cast<std::size_t>(edge), x = static_cast<std::size_t>(place.x);
  const BlockSamples samples{row_of(view, place.y) + x * layout.pixel_bytes, view.stride, edge,
                             width * layout.pixel_bytes};
  BlockScan codes = view.format == PixelFormat::yuyv ? scan_yuyv(samples, reading.rows)
                    : layout.sample_bytes == 2
                        ? scan_words(samples, reading.rows, static_cast<std::uint16_t>(layout.full_scale()))
                        : scan_bytes(samples, reading.rows);
  const auto samples_of_row = static_cast<float>(layout.sampling == ColorSampling::rgb ? 3 * edge : edge);
  const float all = static_cast<float>(codes.all) / (samples_of_row * static_cast<float>(edge)),
              read = static_cast<float>(codes.read) / (samples_of_row * reading.count);
  const bool has_luma = layout.sampling == ColorSampling::ycbcr;
  if (layout.planes == 2)
    codes.largest_chroma = largest_byte({row_of(view, view.height + place.y / 2) + x, view.stride, edge / 2, width});
  // Chroma adds most to blue.
  if (has_luma)
    codes.largest = rgb8_of_ycbcr601(static_cast<int>(codes.largest),
                                     std::max(static_cast<int>(codes.largest_chroma), 128), 128)[2];
  const std::size_t depth = layout.depth_index();
  const std::vector<float>&linear = lens.linear[depth], &of_mean = has_luma ? lens.luma : linear;
  return {interpolate(of_mean, all), interpolate(of_mean, read),
          linear[std::min<std::size_t>(codes.largest, linear.size() - 1)], codes.largest >= lens.saturated_from[depth]};
}

RowError RowSampling::estimate_block(const RowReader& reader, std::size_t block, const Reading& reading,
                                     BlockSums& blocks) const {
  constexpr RowError kReadWhole{std::numeric_limits<float>::infinity(), 0, 0};
  const BlockLayout::Place& place = layout_.place(block);
  const int lens_number = place.lens;
  if (!reader.has(lens_number) || blocks.block_motion[block] > 0) return kReadWhole;
  const Lens& lens = lenses_[static_cast<std::size_t>(lens_number)];
  const auto [sr, inverse_vignetting, scale, shift] = reading.blocks[block];
  CellSum& sum = blocks.sum[block];
  // Mean radiance of the brightest channel, before white balance.
  const auto& w = lens.inverse_white;
  const float brightest = std::max(std::max(sum.r * w[0], sum.g * w[1]), std::max(sum.b * w[2], 0.0F)) * scale / sr;
  const std::span<const RowReader::Exposure> exposures = reader.exposures();
  float radiance_per_linear = 0;
  Scan scanned{0, 0, 0, true};
  for (std::size_t k = exposures.size(); k-- > 0 && scanned.saturated;) {
    radiance_per_linear = exposures[k].radiance_per_linear * inverse_vignetting;
    if (k > 0 && brightest > kWellExposed * radiance_per_linear) continue;
    scanned = scan(exposures[k].view[static_cast<std::size_t>(lens_number)], place, reading);
  }

  const float correction =
      scanned.read > 0 ? std::clamp(scanned.all / scanned.read - 1, -kLargestCorrection, kLargestCorrection) : 0;
  sum = sum * (scale * (1 + correction));
  blocks.block_noise[block] *= scale * scale;
  blocks.block_bias[block] *= scale;
  blocks.clipped[block] *= scale;
  const float luminance = sum.luminance();
  if (luminance > 0) blocks.offset_y[block] = (blocks.offset_y[block] - shift) * reading.gradient;
  if (scanned.saturated && blocks.clipped[block] < 0.999F * sr) return kReadWhole;

  const auto edge = static_cast<float>(layout_.edge());
  const float noise = std::sqrt(blocks.block_noise[block] * edge * reading.count);
  const float excess = (scanned.largest * radiance_per_linear - brightest) * sr - kPeakNoiseSigmas * noise;
  const float missed = kMissedRows * std::max(excess, 0.0F) * lens.largest_white / edge;
  const float corrected = correction * luminance, unsure = std::abs(correction) > kSureCorrection ? kUnsureFactor : 1;
  return {missed + unsure * kCorrectionError * std::abs(corrected), unsure * kCommonError * corrected,
          unsure * kBias * correction * corrected};
}

std::span<const std::uint8_t> RowSampling::estimate(const RowReader& reader, std::span<const std::uint8_t> sampled,
                                                    double max_error, BlockSums& blocks) {
  const Reading& reading = reading_of(reader);
  std::vector<RowError>& errors = blocks.row_error_of_block;
  const auto each_sampled = [&](auto&& visit) {
    for_each_read(sampled, 0, sampled.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t block = first; block < last; ++block) visit(block);
    });
  };
  each_sampled([&](std::size_t block) { errors[block] = estimate_block(reader, block, reading, blocks); });
  const auto limit = static_cast<float>(max_error * luminance_of_all(blocks.sum));
  double common = 0, bias = 0;
  std::ranges::fill(whole_, std::uint8_t{0});
  each_sampled([&](std::size_t block) {
    RowError& error = errors[block];
    // NaN is read whole, too.
    if (!(error.own <= limit)) {
      whole_[block] = 1;
      error = {};
    }
    common += static_cast<double>(error.common);
    bias += static_cast<double>(error.bias);
  });
  if (std::abs(common) + bias <= kMaxCommon * static_cast<double>(limit)) return whole_;
  each_sampled([&](std::size_t block) { errors[block] = {}; });
  return sampled;
}

}  // namespace lightwell::estimate
