#include "estimate/panorama/row_sampling.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <lightwell/color.hpp>

#include "calibration/model/response.hpp"
#include "estimate/frames/row_reader.hpp"

namespace lightwell::estimate {
namespace {

/// Blocks of fewer rows are read whole.
constexpr int kMinEdge = 8;
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
/// The same for the squares of the corrections: a ratio of means has a bias of second order (Cochran 1977, eq. 6.33).
constexpr float kBias = 0.5F;
/// Where the sum of these over all blocks is more than this times the limit of a block, all rows are read.
constexpr double kMaxCommon = 40;
/// Noise makes the brightest of a block's samples brighter by so many standard deviations.
constexpr float kPeakNoiseSigmas = 4;
/// The raw samples of a bracket are those of the longest exposure in which the block's mean is at most this linear
/// value, and no sample is saturated.
constexpr float kWellExposed = 0.25F;
/// Luma of 16 to 235 to codes of 0 to 255; the largest factor of a chroma sample (ITU-R BT.601: of Cb in blue).
constexpr float kLumaScale = 255.0F / 219, kLumaOffset = 16, kChromaScale = 2.017232F, kChromaOffset = 128;

/// Linear value at a code between two entries of the table.
float interpolate(const std::vector<float>& linear, float code) {
  const float at = std::clamp(code, 0.0F, static_cast<float>(linear.size() - 1));
  const auto i = std::min(static_cast<std::size_t>(at), linear.size() - 2);
  return linear[i] + (linear[i + 1] - linear[i]) * (at - static_cast<float>(i));
}

/// `unit`: rows that are decoded at once. `units`: of these that are read.
SampledRows rows_of(int edge, int unit, int units) {
  SampledRows rows{.unit = unit, .units = units};
  const auto whole_units = [unit](int n) { return n / unit * unit; };
  rows.step = whole_units((edge + rows.units - 1) / rows.units);
  rows.offset = whole_units((edge - unit - rows.step * (rows.units - 1)) / 2);
  return rows;
}

double variance_of(const SampledRows& rows, int edge) {
  double sum = 0, squares = 0;
  const int n = rows.count(edge);
  for (int k = 0; k < n; ++k) {
    sum += rows.row(k);
    squares += static_cast<double>(rows.row(k)) * rows.row(k);
  }
  return squares / n - sum / n * (sum / n);
}

}  // namespace

RowSampling::RowSampling(const RigParameters& rig, const RigTable& table, const BlockLayout& layout,
                         std::span<const std::uint8_t> plane)
    : layout_(layout),
      plane_(layout.size()),
      sampled_(layout.size()),
      whole_(layout.size()),
      inverse_vignetting_(layout.size(), 1),
      solid_angle_(layout.size()),
      errors_(layout.size()) {
  if (plane.empty() || layout.edge() < kMinEdge) return;
  for (std::size_t block = 0; block < layout.size(); ++block) {
    const BlockLayout::Place& place = layout.place(block);
    if (plane[block] == 0 || place.width != layout.edge() || place.height != layout.edge()) continue;
    plane_[block] = 1;
    any_ = true;
    const LensTable& lens = table.lenses[static_cast<std::size_t>(place.lens)];
    double sr = 0, weights = 0;
    BlockLayout::for_each_pixel(place, lens, [&](int, int, std::size_t i) {
      sr += lens.solid_angle[i];
      weights += static_cast<double>(lens.solid_angle[i]) * lens.inverse_vignetting[i];
    });
    solid_angle_[block] = static_cast<float>(sr);
    inverse_vignetting_[block] = static_cast<float>(weights / sr);
  }
  single_.rows = rows_of(layout.edge(), 1, 3);
  pairs_.rows = rows_of(layout.edge(), 2, 2);
  bracket_.rows = rows_of(layout.edge(), 1, 2);
  for (Reading* reading : {&single_, &pairs_, &bracket_}) plan(table, *reading);
  for (const LensParameters& lens : rig.lenses) {
    const PhotometricCalibration& photometry = lens.photometry;
    Lens& out = lenses_.emplace_back();
    linear_ = linear_ && photometry.response.kind == ResponseCurve::Kind::linear;
    for (std::size_t k = 0; k < kCodeBits.size(); ++k) {
      out.linear[k] = linear_table(photometry, 1 << kCodeBits[k]);
      out.saturated_from[k] = saturated_from(photometry, 1 << kCodeBits[k]);
    }
    for (std::size_t c = 0; c < 3; ++c) out.inverse_white[c] = static_cast<float>(1 / photometry.white_balance[c]);
    out.largest_white = static_cast<float>(*std::ranges::max_element(photometry.white_balance));
  }
}

void RowSampling::plan(const RigTable& table, Reading& out) const {
  const int edge = layout_.edge();
  out.scale.assign(layout_.size(), 0);
  out.shift.assign(layout_.size(), 0);
  out.gradient = static_cast<float>(variance_of({}, edge) / variance_of(out.rows, edge));
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
    out.scale[block] = static_cast<float>(static_cast<double>(solid_angle_[block]) / sr);
    out.shift[block] = static_cast<float>(moment / sr) - layout_.middle(block).y;
  }
}

bool RowSampling::supports(std::span<const Frame> bracket) const {
  const PixelFormat format = bracket.front().views().front().format;
  if (!any_ || pixel_layout(format).is_float()) return false;
  // The sums of codes of one exposure are those of light, and cost as much as a scan.
  if (bracket.size() == 1 && linear_ && pixel_layout(format).sampling != ColorSampling::ycbcr) return false;
  for (const Frame& frame : bracket)
    for (const View& view : frame.views())
      if (view.format != format) return false;
  return true;
}

const RowSampling::Reading& RowSampling::reading_of(std::span<const Frame> bracket) const {
  const PixelFormat format = bracket.front().views().front().format;
  if (is_bayer(format)) return pairs_;
  if (bracket.size() > 1) return bracket_;
  return format == PixelFormat::nv12 ? pairs_ : single_;
}

std::span<const std::uint8_t> RowSampling::sampled(std::span<const std::uint8_t> read) {
  if (read.empty()) return plane_;
  for (std::size_t block = 0; block < plane_.size(); ++block)
    sampled_[block] = static_cast<std::uint8_t>(plane_[block] & read[block]);
  return sampled_;
}

std::span<const std::uint8_t> RowSampling::others(std::span<const std::uint8_t> read) {
  for (std::size_t block = 0; block < plane_.size(); ++block)
    whole_[block] = static_cast<std::uint8_t>((plane_[block] ^ 1U) & (read.empty() ? 1U : read[block]));
  return whole_;
}

void RowSampling::sort(std::span<const Frame> bracket) {
  exposure_count_ = 0;
  for (const Frame& frame : bracket) {
    Exposure& exposure = exposures_[exposure_count_++];
    exposure.radiance_per_linear = static_cast<float>(1 / (frame.info.exposure_s * frame.info.gain));
    exposure.views.fill(nullptr);
    for (const View& view : frame.views()) exposure.views[static_cast<std::size_t>(view.lens)] = &view;
  }
  std::sort(exposures_.begin(), exposures_.begin() + static_cast<std::ptrdiff_t>(exposure_count_),
            [](const Exposure& a, const Exposure& b) { return a.radiance_per_linear < b.radiance_per_linear; });
}

RowSampling::Scan RowSampling::scan(const View& view, const BlockLayout::Place& place, const SampledRows& rows) const {
  const PixelLayout& layout = pixel_layout(view.format);
  const Lens& lens = lenses_[static_cast<std::size_t>(place.lens)];
  const int edge = layout_.edge();
  const auto width = static_cast<std::size_t>(edge), x = static_cast<std::size_t>(place.x);
  const BlockSamples samples{row_of(view, place.y) + x * layout.pixel_bytes, view.stride, edge,
                             width * layout.pixel_bytes};
  BlockScan codes = view.format == PixelFormat::yuyv ? scan_yuyv(samples, rows)
                    : layout.sample_bytes == 2       ? scan_words(samples, rows)
                                                     : scan_bytes(samples, rows);
  const auto samples_of_row = static_cast<float>(layout.sampling == ColorSampling::rgb ? 3 * place.width : place.width);
  float all = static_cast<float>(codes.all) / (samples_of_row * static_cast<float>(edge)),
        read = static_cast<float>(codes.read) / (samples_of_row * static_cast<float>(rows.count(edge)));
  if (layout.sampling == ColorSampling::ycbcr) {
    if (layout.planes == 2)
      codes.largest_chroma =
          scan_bytes({row_of(view, view.height + place.y / 2) + x, view.stride, edge / 2, width}, {}).largest;
    const auto code = [](float luma) { return (luma - kLumaOffset) * kLumaScale; };
    all = code(all);
    read = code(read);
    const float largest = code(static_cast<float>(codes.largest)) +
                          kChromaScale * std::max(static_cast<float>(codes.largest_chroma) - kChromaOffset, 0.0F);
    codes.largest = static_cast<std::uint32_t>(std::clamp(largest, 0.0F, 255.0F));
  }
  const std::size_t depth = layout.depth_index();
  const std::vector<float>& linear = lens.linear[depth];
  return {interpolate(linear, all), interpolate(linear, read),
          linear[std::min<std::size_t>(codes.largest, linear.size() - 1)], codes.largest >= lens.saturated_from[depth]};
}

RowSampling::Error RowSampling::estimate_block(std::size_t block, const Reading& reading, BlockSums& blocks) const {
  constexpr Error kReadWhole{std::numeric_limits<float>::infinity(), 0, 0};
  const BlockLayout::Place& place = layout_.place(block);
  const auto lens_number = static_cast<std::size_t>(place.lens);
  const Lens& lens = lenses_[lens_number];
  if (blocks.block_motion[block] > 0) return kReadWhole;
  const float scale = reading.scale[block], sr = solid_angle_[block];
  CellSum& sum = blocks.sum[block];
  // Of the brightest channel, before white balance.
  const auto& w = lens.inverse_white;
  const float brightest = std::max({sum.r * w[0], sum.g * w[1], sum.b * w[2], 0.0F}) * scale / sr;
  std::size_t k = 0;
  float radiance_per_linear = 0;
  Scan scanned{0, 0, 0, true};
  for (; k < exposure_count_ && scanned.saturated; ++k) {
    radiance_per_linear = exposures_[k].radiance_per_linear * inverse_vignetting_[block];
    if (k + 1 < exposure_count_ && brightest > kWellExposed * radiance_per_linear) continue;
    const View* view = exposures_[k].views[lens_number];
    if (view == nullptr) return kReadWhole;
    scanned = scan(*view, place, reading.rows);
  }

  const float correction =
      scanned.read > 0 ? std::clamp(scanned.all / scanned.read - 1, -kLargestCorrection, kLargestCorrection) : 0;
  sum = sum * (scale * (1 + correction));
  blocks.block_noise[block] *= scale * scale;
  blocks.block_bias[block] *= scale;
  blocks.clipped[block] *= scale;
  const float luminance = sum.luminance();
  if (luminance > 0) blocks.offset_y[block] = (blocks.offset_y[block] - reading.shift[block]) * reading.gradient;
  if (scanned.saturated && blocks.clipped[block] < 0.999F * sr) return kReadWhole;

  const int edge = layout_.edge();
  const float noise = std::sqrt(blocks.block_noise[block] * static_cast<float>(edge * reading.rows.count(edge)));
  const float excess = (scanned.largest * radiance_per_linear - brightest) * sr - kPeakNoiseSigmas * noise;
  const float missed = kMissedRows * std::max(excess, 0.0F) * lens.largest_white / static_cast<float>(edge);
  const float corrected = correction * luminance, unsure = std::abs(correction) > kSureCorrection ? 4.0F : 1.0F;
  return {missed + unsure * kCorrectionError * std::abs(corrected), unsure * kCommonError * corrected,
          unsure * kBias * correction * corrected};
}

std::span<const std::uint8_t> RowSampling::estimate(std::span<const Frame> bracket,
                                                    std::span<const std::uint8_t> sampled, double max_error,
                                                    BlockSums& blocks) {
  sort(bracket);
  const Reading& reading = reading_of(bracket);
  double luminance = 0;
  for (std::size_t block = 0; block < sampled.size(); ++block) {
    if (sampled[block] != 0) errors_[block] = estimate_block(block, reading, blocks);
    luminance += static_cast<double>(blocks.sum[block].luminance());
  }
  const auto limit = static_cast<float>(max_error * luminance);
  double common = 0, bias = 0;
  for (std::size_t block = 0; block < sampled.size(); ++block) {
    whole_[block] = 0;
    if (sampled[block] == 0) continue;
    const Error& error = errors_[block];
    // NaN is read whole, too.
    const bool fits = error.own <= limit;
    whole_[block] = fits ? 0 : 1;
    blocks.block_rows[block] = fits ? error.own * error.own : 0;
    blocks.block_common[block] = fits ? error.common : 0;
    blocks.block_second[block] = fits ? error.bias : 0;
    common += static_cast<double>(blocks.block_common[block]);
    bias += static_cast<double>(blocks.block_second[block]);
  }
  if (std::abs(common) + bias <= kMaxCommon * static_cast<double>(limit)) return whole_;
  for (std::size_t block = 0; block < sampled.size(); ++block)
    if (sampled[block] != 0) blocks.block_rows[block] = blocks.block_common[block] = blocks.block_second[block] = 0;
  return sampled;
}

}  // namespace lightwell::estimate
