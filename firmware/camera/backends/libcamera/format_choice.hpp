// Which of a camera's pixel formats becomes frames, and which picture of libcamera's is which of ours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

namespace lightwell::libcam {

/// libcamera names formats as DRM does.
struct SupportedFormat {
  std::uint32_t fourcc = 0;
  std::uint64_t modifier = 0;  ///< Not zero: packed, tiled or compressed by its maker's rules.
  std::string name;            ///< As `cam --list` spells it.
};

/// Nothing where bytes lie otherwise than in any of ours. DRM names packed colours from the highest byte of a
/// little-endian word: its BGR888 is r, g, b in memory, and its RGB888 is b, g, r, which none of ours is.
[[nodiscard]] std::optional<PixelFormat> format_of(std::uint32_t fourcc, std::uint64_t modifier);

/// Index into `offered`: the wanted format, or without a wish the first of nv12, yuyv, rgb8, then raw Bayer of most
/// bits. failed_precondition lists what the camera offers.
[[nodiscard]] Result<std::size_t> choose_format(std::span<const SupportedFormat> offered,
                                                std::optional<PixelFormat> wanted);

}  // namespace lightwell::libcam
