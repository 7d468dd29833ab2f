#include "image_object/view_codec.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include <lightwell/bytes.hpp>

#include "image_object/dct.hpp"

namespace lightwell::image_object {
namespace {

/// Basis functions are orthonormal; rounding adds little.
constexpr float kMaxBasis = 1.01F;
/// Planes times blocks of a view: bounds the time that damaged input takes.
constexpr std::size_t kMaxBlockPlanes = std::size_t{1} << 26;
/// Two steps and counts of planes and coefficients for each of two luminances, and the base's step.
constexpr std::size_t kPrefixBytes = 4 + 2 * (4 + 2 + 4);
/// Width of the codes and scale of a basis function.
constexpr std::size_t kPlaneBytes = 1 + 4;
/// Levels of coverage between none and all.
constexpr int kCoverageLevels = 16;

Status damaged(const std::string& what) {
  return {StatusCode::data_loss, "the view is damaged: " + what + "; get the file again"};
}

int largest_code(bool precise) { return precise ? 32767 : 127; }

float scale_of(const LightPlanes& planes, std::size_t plane, std::size_t lights) {
  float largest = 0;
  for (std::size_t i = 0; i < lights; ++i) largest = std::max(largest, std::abs(planes.basis[plane * lights + i]));
  return largest / static_cast<float>(largest_code(planes.precise[plane]));
}

int code_of(float value, float scale) { return scale > 0 ? static_cast<int>(std::lround(value / scale)) : 0; }

template <class Number>
void append(std::string& out, Number value) {
  std::array<char, sizeof(Number)> bytes{};
  put_le(bytes.data(), value);
  out.append(bytes.data(), bytes.size());
}

/// Reads fields one after the other; beyond the end they are zero and ok() is false.
class FieldReader {
 public:
  explicit FieldReader(std::span<const std::byte> in) : in_(in) {}
  template <class Number>
  Number take() {
    if (in_.size() < sizeof(Number)) {
      ok_ = false;
      in_ = {};
      return 0;
    }
    const Number value = get_le<Number>(in_.data());
    in_ = in_.subspan(sizeof(Number));
    return value;
  }
  float take_float() { return std::bit_cast<float>(take<std::uint32_t>()); }
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::span<const std::byte> rest() const { return in_; }

 private:
  std::span<const std::byte> in_;
  bool ok_ = true;
};

void append_basis(std::string& out, const LightPlanes& planes, std::size_t lights) {
  for (std::size_t k = 0; k < planes.planes; ++k) {
    const float scale = scale_of(planes, k, lights);
    append(out, static_cast<std::uint8_t>(planes.precise[k] ? 2 : 1));
    append(out, std::bit_cast<std::uint32_t>(scale));
    for (std::size_t i = 0; i < lights; ++i) {
      const int code = code_of(planes.basis[k * lights + i], scale);
      if (planes.precise[k])
        append(out, static_cast<std::int16_t>(code));
      else
        append(out, static_cast<std::int8_t>(code));
    }
  }
}

Status read_basis(FieldReader& in, LightPlanes& planes, std::size_t lights) {
  if (in.rest().size() < planes.planes * (kPlaneBytes + lights)) return damaged("it ends in its basis");
  planes.basis.resize(planes.planes * lights);
  for (std::size_t k = 0; k < planes.planes; ++k) {
    const auto width = in.take<std::uint8_t>();
    if (width != 1 && width != 2) return damaged("the codes of a basis function have neither 1 nor 2 bytes");
    const bool precise = width == 2;
    planes.precise.push_back(precise);
    const float scale = in.take_float();
    if (!(scale >= 0 && scale * static_cast<float>(largest_code(precise)) <= kMaxBasis))
      return damaged("a basis function has values above 1");
    for (std::size_t i = 0; i < lights; ++i)
      planes.basis[k * lights + i] =
          scale * static_cast<float>(precise ? int{in.take<std::int16_t>()} : int{in.take<std::int8_t>()});
  }
  return in.ok() ? Status() : damaged("it ends in its basis");
}

/// Coverage: none, all, or one of 16 levels between, in rows.
class CoverageModels {
 public:
  template <class Bits>
  void code(Bits& bits, const DecodedView& view, std::uint8_t* pixel, int column, int row) {
    const std::size_t left = column > 0 ? kind(pixel[-1]) : 0;
    const std::size_t above = row > 0 ? kind(*(pixel - view.columns)) : 0;
    const std::size_t beside = row > 0 && column + 1 < view.columns ? kind(*(pixel - view.columns + 1)) : 0;
    auto& models = models_[left][above][beside];
    const std::size_t own = kind(*pixel);
    if (!bits(own != 0, models[0])) {
      *pixel = 0;
    } else if (!bits(own != 2, models[1])) {
      *pixel = 255;
    } else {
      int value = 0;
      for (int bit = 3; bit >= 0; --bit) value = 2 * value + (bits.raw((level_of(*pixel) >> bit & 1) != 0) ? 1 : 0);
      *pixel = static_cast<std::uint8_t>(value * 255 / kCoverageLevels + 8);
    }
  }

 private:
  static std::size_t kind(std::uint8_t coverage) { return coverage == 0 ? 0 : coverage == 255 ? 2 : 1; }
  static int level_of(std::uint8_t coverage) { return std::min(coverage * kCoverageLevels / 255, kCoverageLevels - 1); }
  std::array<std::array<std::array<std::array<BitModel, 2>, 3>, 3>, 3> models_;
};

template <class Bits>
void code_coverage(Bits& bits, DecodedView& view) {
  CoverageModels models;
  std::uint8_t* pixel = view.coverage.data();
  for (int row = 0; row < view.rows; ++row)
    for (int column = 0; column < view.columns; ++column) models.code(bits, view, pixel++, column, row);
}

/// Calls block(live block, column of blocks) for each live block, start_row() where a row of blocks begins.
template <class StartRow, class Block>
void each_live_block(const DecodedView& view, const StartRow& start_row, const Block& block) {
  std::uint32_t row = std::numeric_limits<std::uint32_t>::max();
  const auto columns = static_cast<std::uint32_t>(view.block_columns);
  for (std::size_t i = 0; i < view.live.size(); ++i) {
    if (view.live[i] / columns != row) start_row();
    row = view.live[i] / columns;
    if (!block(i, view.live[i] % columns)) return;
  }
}

/// Codes planes of all live blocks; levels(live block, plane) is called for each before, done(...) after.
template <class Bits, class Before, class After>
void code_planes(Bits& bits, const DecodedView& view, std::size_t planes, const Before& before, const After& after) {
  BlockModels models;
  NeighbourCounts neighbours(planes, static_cast<std::size_t>(view.block_columns));
  BlockLevels levels;
  each_live_block(
      view, [&] { neighbours.start_row(); },
      [&](std::size_t i, std::uint32_t column) {
        BlockModels::Context context;
        for (std::size_t k = 0; k < planes; ++k) {
          before(i, k, levels);
          models.code(bits, levels, context, neighbours.sum(k, column));
          neighbours.set(k, column, levels.count);
          if (!after(i, k, levels)) return false;
        }
        return true;
      });
}

void write_planes(BitWriter& bits, const DecodedView& view, std::size_t planes, const std::vector<BlockLevels>& all) {
  code_planes(
      bits, view, planes, [&](std::size_t i, std::size_t k, BlockLevels& levels) { levels = all[i * planes + k]; },
      [](std::size_t, std::size_t, const BlockLevels&) { return true; });
}

/// Larger levels are the sum of several coefficients.
constexpr int kMaxPart = 32767;

std::uint32_t count_coefficients(const std::vector<BlockLevels>& all) {
  std::uint32_t n = 0;
  for (const BlockLevels& levels : all)
    for (const std::int32_t level : levels.level)
      n += static_cast<std::uint32_t>((std::abs(level) + kMaxPart - 1) / kMaxPart);
  return n;
}

/// Reads `count` coefficients. False if there are more or fewer.
bool read_planes(BitReader& bits, const DecodedView& view, std::size_t count, LightPlanes& out) {
  out.coefficients.reserve(count);
  out.begin.assign(view.live.size() + 1, 0);
  if (out.planes == 0) return count == 0;
  bool fits = true;
  code_planes(
      bits, view, out.planes, [](std::size_t, std::size_t, const BlockLevels&) {},
      [&](std::size_t i, std::size_t k, const BlockLevels& levels) {
        for (int z = 0; z < levels.count; ++z) {
          const auto where = static_cast<std::uint16_t>(k * kBlockPixels + kZigzag[static_cast<std::size_t>(z)]);
          for (int rest = levels.level[static_cast<std::size_t>(z)]; rest != 0;) {
            if (out.coefficients.size() == count) return fits = false;
            const int part = std::clamp(rest, -kMaxPart, kMaxPart);
            out.coefficients.push_back({where, static_cast<std::int16_t>(part)});
            rest -= part;
          }
        }
        out.begin[i + 1] = static_cast<std::uint32_t>(out.coefficients.size());
        return !bits.coder.overrun();
      });
  return fits && out.coefficients.size() == count && !bits.coder.overrun();
}

/// Reads the base of all live blocks and its gains.
bool read_base(BitReader& bits, float step, DecodedView& view) {
  view.base.resize(view.live.size() * kBlockPixels);
  view.gain.resize(view.live.size());
  BasePlanes planes{};
  code_planes(
      bits, view, kBasePlanes, [](std::size_t, std::size_t, const BlockLevels&) {},
      [&](std::size_t i, std::size_t k, const BlockLevels& levels) {
        BlockValues values{};
        for (int z = 0; z < levels.count; ++z)
          values[kZigzag[static_cast<std::size_t>(z)]] =
              step * kBaseSteps[k] * static_cast<float>(levels.level[static_cast<std::size_t>(z)]);
        planes[k] = inverse_dct(values);
        if (k + 1 == kBasePlanes) {
          const std::span<BasePixel, kBlockPixels> out(view.base.data() + i * kBlockPixels, kBlockPixels);
          base_pixels(planes, out);
          view.gain[i] = gain_of(view, view.live[i], out);
        }
        return !bits.coder.overrun();
      });
  return !bits.coder.overrun();
}

}  // namespace

void round_basis(LightPlanes& planes, std::size_t lights) {
  for (std::size_t k = 0; k < planes.planes; ++k) {
    const float scale = scale_of(planes, k, lights);
    for (std::size_t i = 0; i < lights; ++i) {
      float& value = planes.basis[k * lights + i];
      value = scale * static_cast<float>(code_of(value, scale));
    }
  }
}

std::string write_view(const QuantizedView& view) {
  std::string out;
  const std::size_t lights = view.layout.directions.size();
  append(out, std::bit_cast<std::uint32_t>(view.base_step));
  for (const auto& [planes, levels] :
       {std::pair{&view.luminance, &view.luminance_levels}, std::pair{&view.highlight, &view.highlight_levels}}) {
    append(out, std::bit_cast<std::uint32_t>(planes->step));
    append(out, static_cast<std::uint16_t>(planes->planes));
    append(out, count_coefficients(*levels));
  }
  append_basis(out, view.luminance, lights);
  append_basis(out, view.highlight, lights);
  RangeEncoder coder;
  BitWriter bits{coder};
  DecodedView layout = view.layout;
  code_coverage(bits, layout);
  write_planes(bits, view.layout, kBasePlanes, view.base);
  write_planes(bits, view.layout, view.luminance.planes, view.luminance_levels);
  write_planes(bits, view.layout, view.highlight.planes, view.highlight_levels);
  return out + coder.finish();
}

namespace {

/// What precedes the range-coded stream.
struct ViewPrefix {
  float base_step = 0;
  std::array<std::uint32_t, 2> counts{};  ///< Coefficients of luminance and highlights.
  std::span<const std::byte> stream;
};

/// Reads the prefix, and sizes and bases of the view.
Result<ViewPrefix> read_prefix(const ObjectRig& rig, std::span<const std::byte> bytes, DecodedView& view) {
  if (bytes.size() < kPrefixBytes) return damaged("it ends in its header");
  const std::size_t lights = rig.light_positions.size();
  FieldReader in(bytes);
  ViewPrefix out;
  out.base_step = in.take_float();
  const std::array<LightPlanes*, 2> all = {&view.luminance, &view.highlight};
  for (std::size_t n = 0; n < 2; ++n) {
    all[n]->step = in.take_float();
    all[n]->planes = in.take<std::uint16_t>();
    out.counts[n] = in.take<std::uint32_t>();
    if (all[n]->planes > lights) return damaged("it has more basis functions than lights");
    if (!(all[n]->step >= 0 && all[n]->step <= 1)) return damaged("a step is not 0 to 1");
  }
  if (!(out.base_step >= 0 && out.base_step <= 1)) return damaged("a step is not 0 to 1");
  for (LightPlanes* planes : all)
    if (const Status read = read_basis(in, *planes, lights); !read.ok()) return read;
  out.stream = in.rest();
  // The sign of each coefficient takes a bit; of the many that make a large level, more than one.
  if (std::uint64_t{out.counts[0]} + out.counts[1] > 8 * std::uint64_t{out.stream.size()})
    return damaged("it has fewer bits than coefficients");
  set_size(view, rig.columns, rig.rows);
  const std::size_t blocks = static_cast<std::size_t>(view.block_columns) * static_cast<std::size_t>(view.block_rows);
  if (blocks * (view.luminance.planes + view.highlight.planes) > kMaxBlockPlanes)
    return damaged("it has more than 2^26 blocks of basis functions");
  view.coverage.resize(static_cast<std::size_t>(rig.columns) * static_cast<std::size_t>(rig.rows));
  return out;
}

}  // namespace

Result<DecodedView> read_coverage(const ObjectRig& rig, std::span<const std::byte> bytes) {
  DecodedView view;
  const auto prefix = read_prefix(rig, bytes, view);
  if (!prefix.ok()) return prefix.status();
  RangeDecoder coder(prefix->stream);
  BitReader bits{coder};
  code_coverage(bits, view);
  if (coder.overrun()) return damaged("it ends in its coverage");
  return view;
}

Result<std::shared_ptr<const DecodedView>> read_view(const ObjectRig& rig, float turn_rad,
                                                     std::span<const std::byte> bytes) {
  auto view = std::make_shared<DecodedView>();
  const auto prefix = read_prefix(rig, bytes, *view);
  if (!prefix.ok()) return prefix.status();
  view->turn_rad = turn_rad;
  view->reference_irradiance = rig.reference_irradiance;
  for (const Vec3f& position : rig.light_positions) view->directions.push_back(normalized(position));
  RangeDecoder coder(prefix->stream);
  BitReader bits{coder};
  code_coverage(bits, *view);
  if (coder.overrun()) return damaged("it ends in its coverage");
  find_live_blocks(*view);
  if (!read_base(bits, prefix->base_step, *view)) return damaged("it ends in its base colour");
  if (!read_planes(bits, *view, prefix->counts[0], view->luminance) ||
      !read_planes(bits, *view, prefix->counts[1], view->highlight))
    return damaged("its coefficients are not as many as it says");
  return std::shared_ptr<const DecodedView>(std::move(view));
}

}  // namespace lightwell::image_object
