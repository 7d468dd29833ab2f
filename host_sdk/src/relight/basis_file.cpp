// Files of photographs: BasisWriter, BasisReader. Little-endian: "LWRB", version, columns, rows, lights (u32 each);
// then frames. A frame: the largest radiance of each photograph (f32), then bands of kBandRows rows (the last one may
// have fewer); a band: of each photograph its planes of red, green, blue, one byte a value.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include <lightwell/files.hpp>
#include <lightwell/relight_stream.hpp>

#include "relight/alpha.hpp"
#include "relight/code_sum.hpp"
#include "relight/subject.hpp"

namespace lightwell {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little-endian");

constexpr std::array<char, 4> kMagic = {'L', 'W', 'R', 'B'};
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 20;
/// Sums of a band of 800 columns are 150 KB: they stay in a cache while all photographs are added.
constexpr int kBandRows = 16;
constexpr float kMaxCode = 255;

using Header = std::array<std::uint32_t, 4>;  // Version, columns, rows, lights.

int band_rows(const BasisFileInfo& info, std::size_t band) {
  return std::min(kBandRows, info.rows - static_cast<int>(band) * kBandRows);
}

std::size_t bands(const BasisFileInfo& info) {
  return static_cast<std::size_t>((info.rows + kBandRows - 1) / kBandRows);
}

/// Values of a plane of a band.
std::size_t band_values(const BasisFileInfo& info, std::size_t band) {
  return static_cast<std::size_t>(band_rows(info, band)) * static_cast<std::size_t>(info.columns);
}

std::uint64_t frame_bytes(const BasisFileInfo& info) {
  return std::uint64_t{info.lights} *
         (4 + 3 * static_cast<std::uint64_t>(info.columns) * static_cast<std::uint64_t>(info.rows));
}

bool is_valid(const BasisFileInfo& info) {
  return info.columns >= 1 && info.rows >= 1 && info.columns <= RelightCamera::kMaxSide &&
         info.rows <= RelightCamera::kMaxSide && info.lights >= 1 && info.lights <= AlphaMaps::kMaxLights;
}

float clean(float v) { return v > 0 && v <= std::numeric_limits<float>::max() ? v : 0.0F; }

}  // namespace

Result<BasisWriter> BasisWriter::create(const std::string& path, int columns, int rows, std::size_t lights) {
  const BasisFileInfo info{columns, rows, lights, 0};
  if (!is_valid(info))
    return invalid_argument("photographs: 1 to 4096 columns and rows and 1 to 256 lights are possible");
  std::ofstream file(path_of(path), std::ios::binary | std::ios::trunc);
  const Header header = {kVersion, static_cast<std::uint32_t>(columns), static_cast<std::uint32_t>(rows),
                         static_cast<std::uint32_t>(lights)};
  file.write(kMagic.data(), kMagic.size());
  file.write(reinterpret_cast<const char*>(header.data()), sizeof header);
  if (!file) return Status(StatusCode::not_found, path + ": cannot be written");
  return BasisWriter(std::move(file), info);
}

Status BasisWriter::add(BasisPictures frame) {
  if (frame.size() != info_.lights)
    return invalid_argument("there are " + std::to_string(frame.size()) + " photographs, the file has " +
                            std::to_string(info_.lights));
  const std::size_t pixels = static_cast<std::size_t>(info_.columns) * static_cast<std::size_t>(info_.rows);
  for (std::size_t i = 0; i < frame.size(); ++i)
    if (Status status = relight::check_size("photograph " + std::to_string(i), frame[i].size(), pixels); !status.ok())
      return status;
  std::vector<float> scales(info_.lights);
  for (std::size_t i = 0; i < frame.size(); ++i)
    for (const Radiance& r : frame[i]) scales[i] = std::max({scales[i], clean(r.r), clean(r.g), clean(r.b)});
  bytes_.resize(scales.size() * sizeof(float));
  std::memcpy(bytes_.data(), scales.data(), bytes_.size());
  for (std::size_t band = 0; band < bands(info_); ++band) {
    const std::size_t first = band * band_values(info_, 0), values = band_values(info_, band);
    for (std::size_t i = 0; i < frame.size(); ++i)
      for (int c = 0; c < 3; ++c)
        for (const Radiance& r : frame[i].subspan(first, values))
          bytes_.push_back(
              static_cast<char>(scales[i] > 0 ? std::lround(kMaxCode * std::sqrt(clean(r[c]) / scales[i])) : 0));
  }
  if (!file_.write(bytes_.data(), static_cast<std::streamsize>(bytes_.size())))
    return {StatusCode::resource_exhausted, "the photographs cannot be written: is the disk full?"};
  ++info_.frames;
  return {};
}

Status BasisWriter::close() {
  file_.close();
  if (!file_) return {StatusCode::resource_exhausted, "the photographs cannot be written: is the disk full?"};
  return {};
}

BasisReader::BasisReader(std::ifstream file, const BasisFileInfo& info)
    : file_(std::move(file)),
      info_(info),
      scales_(info.lights),
      codes_(3 * band_values(info, 0)),
      sums_(codes_.size()) {}

Result<BasisReader> BasisReader::open(const std::string& path) {
  std::ifstream file;
  // Large reads go to memory directly.
  file.rdbuf()->pubsetbuf(nullptr, 0);
  file.open(path_of(path), std::ios::binary);
  if (!file) return Status(StatusCode::not_found, path + ": cannot be opened");
  std::array<char, 4> magic{};
  Header header{};
  file.read(magic.data(), magic.size());
  file.read(reinterpret_cast<char*>(header.data()), sizeof header);
  if (!file || magic != kMagic) return Status(StatusCode::data_loss, path + ": is no file of photographs (LWRB)");
  if (header[0] != kVersion)
    return invalid_argument(path + ": has version " + std::to_string(header[0]) + ", this library reads version 1");
  const auto side = [](std::uint32_t v) { return v <= RelightCamera::kMaxSide ? static_cast<int>(v) : 0; };
  BasisFileInfo info{side(header[1]), side(header[2]), header[3], 0};
  if (!is_valid(info)) return Status(StatusCode::data_loss, path + ": has an impossible size");
  file.seekg(0, std::ios::end);
  const auto size = static_cast<std::uint64_t>(file.tellg()) - kHeaderBytes;
  if (!file || size % frame_bytes(info) != 0) return Status(StatusCode::data_loss, path + ": is truncated");
  info.frames = static_cast<std::size_t>(size / frame_bytes(info));
  BasisReader reader(std::move(file), info);
  reader.at_ = size + kHeaderBytes;
  return reader;
}

Status BasisReader::read_scales(std::size_t frame) {
  if (frame >= info_.frames)
    return {StatusCode::not_found,
            "frame " + std::to_string(frame) + " does not exist, there are " + std::to_string(info_.frames)};
  at_ = kHeaderBytes + frame * frame_bytes(info_);
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(at_));
  const std::size_t bytes = scales_.size() * sizeof(float);
  file_.read(reinterpret_cast<char*>(scales_.data()), static_cast<std::streamsize>(bytes));
  at_ += bytes;
  if (!file_ || !std::ranges::all_of(scales_, [](float s) { return s >= 0 && std::isfinite(s); }))
    return {StatusCode::data_loss, "frame " + std::to_string(frame) + " is damaged"};
  return {};
}

Status BasisReader::read_codes(std::size_t frame, std::size_t band, std::size_t light) {
  const std::uint64_t values = 3 * band_values(info_, band);
  const std::uint64_t wanted = kHeaderBytes + frame * frame_bytes(info_) + scales_.size() * sizeof(float) +
                               3 * info_.lights * band * band_values(info_, 0) + light * values;
  if (wanted != at_) file_.seekg(static_cast<std::streamoff>(wanted));
  file_.read(reinterpret_cast<char*>(codes_.data()), static_cast<std::streamsize>(values));
  at_ = wanted + values;
  if (!file_) return {StatusCode::data_loss, "the file of photographs ends within frame " + std::to_string(frame)};
  return {};
}

Status BasisReader::relight(const AlphaMaps& alpha, std::size_t frame, std::span<Radiance> out) {
  const relight::AlphaData& data = alpha.data();
  const std::size_t pixels = static_cast<std::size_t>(info_.columns) * static_cast<std::size_t>(info_.rows);
  if (data.weights.size() != info_.lights || data.pixels != pixels)
    return invalid_argument("alpha has " + std::to_string(data.weights.size()) + " lights and " +
                            std::to_string(data.pixels) + " pixels, the file has " + std::to_string(info_.lights) +
                            " and " + std::to_string(pixels));
  if (Status status = relight::check_size("the output", out.size(), pixels); !status.ok()) return status;
  if (Status status = read_scales(frame); !status.ok()) return status;
  for (std::size_t band = 0; band < bands(info_); ++band) {
    const std::size_t first = band * band_values(info_, 0), values = band_values(info_, band);
    std::ranges::fill(sums_, 0.0F);
    for (std::size_t i = 0; i < info_.lights; ++i) {
      const relight::AlphaMap& map = data.maps[i];
      if (!map.used && data.weights[i] == RgbFactor{}) continue;
      if (Status status = read_codes(frame, band, i); !status.ok()) return status;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::uint8_t* const codes = codes_.data() + c * values;
        float* const sums = sums_.data() + c * values;
        const float gain = scales_[i] / (kMaxCode * kMaxCode), weight = data.weights[i][static_cast<int>(c)];
        if (map.used) {
          relight::add_codes(codes, gain, weight, map.planes.data() + c * pixels + first, sums, values);
        } else {
          relight::add_codes(codes, gain * weight, sums, values);
        }
      }
    }
    for (std::size_t p = 0; p < values; ++p) out[first + p] = {sums_[p], sums_[values + p], sums_[2 * values + p]};
  }
  for (std::size_t p = 0; p < data.modelled.size(); ++p) out[p] += data.modelled[p];
  return {};
}

Status BasisReader::read(std::size_t frame, std::size_t light, std::span<Radiance> out) {
  if (light >= info_.lights)
    return {StatusCode::not_found,
            "photograph " + std::to_string(light) + " does not exist, there are " + std::to_string(info_.lights)};
  const std::size_t pixels = static_cast<std::size_t>(info_.columns) * static_cast<std::size_t>(info_.rows);
  if (Status status = relight::check_size("the output", out.size(), pixels); !status.ok()) return status;
  if (Status status = read_scales(frame); !status.ok()) return status;
  for (std::size_t band = 0; band < bands(info_); ++band) {
    if (Status status = read_codes(frame, band, light); !status.ok()) return status;
    const std::size_t first = band * band_values(info_, 0), values = band_values(info_, band);
    const float gain = scales_[light] / (kMaxCode * kMaxCode);
    for (std::size_t p = 0; p < values; ++p)
      for (std::size_t c = 0; c < 3; ++c) {
        const auto code = static_cast<float>(codes_[c * values + p]);
        out[first + p][static_cast<int>(c)] = gain * (code * code);
      }
  }
  return {};
}

}  // namespace lightwell
