// Checks the structure of a JPEG (ITU-T T.81, annex B): walks the segments to the end marker before decoding, because
// libjpeg fills missing data with grey. image_libjpeg.cpp decodes the pixels. JPEG has no checksum: bit errors inside
// the entropy-coded data that do not produce a marker cannot be detected.
#include <algorithm>

#include "imaging/image_readers.hpp"

namespace lightwell {
namespace {

constexpr int kStartOfImage = 0xD8, kEndOfImage = 0xD9, kStartOfScan = 0xDA;

/// Start-of-frame markers of all JPEG processes.
bool is_frame_header(int marker) {
  constexpr int kHuffmanTables = 0xC4, kReserved = 0xC8, kArithmeticTables = 0xCC;
  return marker >= 0xC0 && marker <= 0xCF && marker != kHuffmanTables && marker != kReserved &&
         marker != kArithmeticTables;
}

bool stands_alone(int marker) { return marker == 0x01 || (marker >= 0xD0 && marker <= 0xD7); }

int byte_at(std::span<const std::byte> file, std::size_t i) { return std::to_integer<int>(file[i]); }
int big_endian_16(std::span<const std::byte> file, std::size_t i) {
  return byte_at(file, i) << 8 | byte_at(file, i + 1);
}

Status check_frame(const std::string& name, int marker, std::span<const std::byte> segment) {
  if (marker > 0xC2) return image_refused(name, "a rare kind of JPEG; save it as baseline");
  if (segment.size() < 8) return image_damaged(name, "the JPEG's frame header is too short");
  if (byte_at(segment, 2) != 8)
    return image_refused(name, "a JPEG of " + std::to_string(byte_at(segment, 2)) + " bits; save it with 8");
  if (Status s = check_image_size(name, big_endian_16(segment, 5), big_endian_16(segment, 3)); !s.ok()) return s;
  const int components = byte_at(segment, 7);
  if (components != 1 && components != 3)
    return image_refused(name, "a JPEG of " + std::to_string(components) + " components (CMYK?); save it as RGB");
  return {};
}

/// Position of the next marker's 0xFF at or after `at`; skips entropy-coded data, stuffed zeros and restart markers.
std::size_t scan_end(std::span<const std::byte> file, std::size_t at) {
  for (; at + 1 < file.size(); ++at) {
    if (byte_at(file, at) != 0xFF) continue;
    const int next = byte_at(file, at + 1);
    if (next != 0x00 && next != 0xFF && !stands_alone(next)) return at;
  }
  return file.size();
}

/// Whether the bytes after the end marker are legitimate: cameras append a second picture (MPF) or pad with zeros.
/// Anything else is the rest of a scan with a premature end marker.
bool may_follow_the_end(std::span<const std::byte> rest) {
  if (rest.size() >= 2 && byte_at(rest, 0) == 0xFF && byte_at(rest, 1) == kStartOfImage) return true;
  return std::ranges::all_of(rest, [](std::byte b) { return b == std::byte{0}; });
}

}  // namespace

Result<Image> read_jpeg(const std::string& name, std::span<const std::byte> file) {
  std::size_t at = 2;
  bool has_frame = false, has_scan = false;
  const auto truncated = [&] {
    return image_truncated(name, has_scan ? "the JPEG has no end marker" : "the JPEG's pixels are missing");
  };
  while (true) {
    if (at + 1 >= file.size()) return truncated();
    if (byte_at(file, at) != 0xFF) return image_damaged(name, "no JPEG marker at byte " + std::to_string(at));
    const int marker = byte_at(file, at + 1);
    if (marker == 0xFF) {  // A fill byte.
      ++at;
      continue;
    }
    at += 2;
    if (marker == kEndOfImage) break;
    if (marker == kStartOfImage || marker == 0)
      return image_damaged(name, "a JPEG marker out of place at byte " + std::to_string(at - 2));
    if (stands_alone(marker)) continue;

    if (file.size() - at < 2) return truncated();
    const auto length = static_cast<std::size_t>(big_endian_16(file, at));
    if (length < 2) return image_damaged(name, "a JPEG segment without a length");
    if (file.size() - at < length) return truncated();
    if (is_frame_header(marker)) {
      if (Status s = check_frame(name, marker, file.subspan(at, length)); !s.ok()) return s;
      has_frame = true;
    }
    at += length;
    if (marker == kStartOfScan) {
      has_scan = true;
      at = scan_end(file, at);
    }
  }
  if (!has_frame || !has_scan) return image_damaged(name, "the JPEG has no pixels");
  if (!may_follow_the_end(file.subspan(at)))
    return image_damaged(
        name, "the JPEG's end marker comes " + std::to_string(file.size() - at) + " bytes before the file ends");
  return decode_jpeg(name, file);
}

}  // namespace lightwell
