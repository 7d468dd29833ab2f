// Encodes pictures as JPEG with libjpeg.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell {

/// Where chroma has half the resolution.
enum class ChromaSampling : std::uint8_t { yuv420 /* in both directions */, yuv422 /* along rows */ };

struct JpegOptions {
  int quality = 80;  ///< libjpeg's scale, 1 to 100.
  ChromaSampling chroma = ChromaSampling::yuv420;
};

/// Baseline JPEG (JFIF, YCbCr), the same bytes on all machines with one libjpeg. `rgb`: 3 bytes a pixel, rows from the
/// top without padding. invalid_argument: a side below 1 or above 65,500, or another number of bytes; internal:
/// libjpeg's error.
[[nodiscard]] Result<std::vector<std::byte>> encode_jpeg(std::span<const std::byte> rgb, int width, int height,
                                                         const JpegOptions& options);

}  // namespace lightwell
