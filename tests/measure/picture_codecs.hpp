// Picture and video codecs that image-based objects are compared with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lightwell/color.hpp>

namespace lightwell::measure {

/// A linear picture (0 to 1; clamped) as sRGB of 8 bits, 3 bytes a pixel, and back.
[[nodiscard]] std::vector<std::uint8_t> codes_of(const std::vector<Radiance>& picture);
[[nodiscard]] std::vector<Radiance> picture_of(std::span<const std::uint8_t> codes);

/// A compressed picture or sequence, and what is decoded from it.
struct CodedPicture {
  std::size_t bytes = 0;
  std::vector<std::uint8_t> rgb;
};

/// JPEG without subsampled colour (4:4:4) or with (4:2:0), with optimised Huffman tables, progressive: the smallest
/// that libjpeg makes of a quality.
struct JpegSetting {
  int quality = 90;
  bool subsampled = false;
};
/// nullopt: libjpeg failed. `rgb`: 3 bytes a pixel.
[[nodiscard]] std::optional<CodedPicture> code_jpeg(std::span<const std::uint8_t> rgb, int width, int height,
                                                    JpegSetting setting);

/// The pictures one after the other as H.264 by x264 (preset slow, 4:4:4), by the program ffmpeg. nullopt: there is no
/// ffmpeg, or it failed. Uses the folder for files.
[[nodiscard]] std::optional<CodedPicture> code_x264(std::span<const std::uint8_t> frames, int width, int height,
                                                    int crf, const std::string& folder);

}  // namespace lightwell::measure
