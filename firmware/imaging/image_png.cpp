// Checks the structure of a PNG (W3C PNG, third edition): all chunks complete with the right CRC, IHDR first, IEND
// last. image_libpng.cpp decodes the pixels.
#include <array>
#include <cstring>
#include <string_view>

#include "imaging/image_readers.hpp"

namespace lightwell {
namespace {

constexpr std::string_view kSignature("\x89PNG\r\n\x1A\n", 8);

/// CRC-32 of PNG and zlib (polynomial 0x04C11DB7, reflected); recordings use CRC-32C instead.
std::uint32_t crc32(std::span<const std::byte> bytes) {
  static const auto table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      std::uint32_t v = i;
      for (int k = 0; k < 8; ++k) v = (v & 1U) != 0 ? (v >> 1) ^ 0xEDB88320U : v >> 1;
      t[i] = v;
    }
    return t;
  }();
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const std::byte b : bytes) crc = (crc >> 8) ^ table[(crc ^ std::to_integer<std::uint32_t>(b)) & 255U];
  return ~crc;
}

std::uint32_t big_endian_32(std::span<const std::byte> at) {
  std::uint32_t v = 0;
  for (std::size_t i = 0; i < 4; ++i) v = v << 8 | std::to_integer<std::uint32_t>(at[i]);
  return v;
}

Status check_header(const std::string& name, std::span<const std::byte> data) {
  if (data.size() != 13) return image_damaged(name, "the PNG's header has a wrong length");
  const std::uint32_t width = big_endian_32(data), height = big_endian_32(data.subspan(4));
  if (Status s = check_image_size(name, width, height); !s.ok()) return s;
  const auto depth = std::to_integer<int>(data[8]), color = std::to_integer<int>(data[9]);
  if (depth == 16)
    return image_refused(name,
                         "16 bits a channel; convert it to 8, or to OpenEXR where the "
                         "values matter");
  constexpr int kGreyAlpha = 4, kRgbAlpha = 6;
  if (color == kGreyAlpha || color == kRgbAlpha)
    return image_refused(name,
                         "an alpha channel: no camera sees a pixel in part; export it "
                         "without alpha");
  return {};
}

}  // namespace

Result<Image> read_png(const std::string& name, std::span<const std::byte> file) {
  if (file.size() < kSignature.size()) return image_truncated(name, "inside the PNG's signature");
  if (std::memcmp(file.data(), kSignature.data(), kSignature.size()) != 0)
    return image_damaged(name, "the PNG's signature was changed, as a transfer in text mode does");
  std::size_t at = kSignature.size();
  bool has_header = false, has_pixels = false;
  while (true) {
    constexpr std::size_t kChunkOverhead = 12;  // Length, type and CRC.
    const std::span<const std::byte> rest = file.subspan(at);
    if (rest.size() < kChunkOverhead || rest.size() - kChunkOverhead < big_endian_32(rest))
      return image_truncated(name, has_pixels ? "the PNG's end is missing" : "the PNG's pixels are missing");
    const std::size_t length = big_endian_32(rest);
    const std::string_view type(reinterpret_cast<const char*>(rest.data()) + 4, 4);
    const auto data = rest.subspan(8, length);
    if (crc32(rest.subspan(4, 4 + length)) != big_endian_32(rest.subspan(8 + length)))
      return image_damaged(name, "a PNG chunk at byte " + std::to_string(at) + " has a wrong CRC");
    at += kChunkOverhead + length;

    if (type == "IHDR" && !has_header) {
      if (Status s = check_header(name, data); !s.ok()) return s;
      has_header = true;
    } else if (!has_header) {
      return image_damaged(name, "the PNG does not begin with its header");
    } else if (type == "tRNS") {
      return image_refused(name, "a transparent colour; export it without alpha");
    } else if (type == "IDAT") {
      has_pixels = true;
    } else if (type == "IEND") {
      break;
    }
  }
  if (!has_pixels) return image_damaged(name, "the PNG has no pixels");
  return decode_png(name, file);
}

}  // namespace lightwell
