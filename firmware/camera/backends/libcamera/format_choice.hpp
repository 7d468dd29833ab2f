// Chooses a camera's pixel format, and maps libcamera's formats to PixelFormat.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

namespace lightwell::libcam {

/// A pixel format, named by DRM fourcc and modifier as in libcamera.
struct SupportedFormat {
  std::uint32_t fourcc = 0;
  std::uint64_t modifier = 0;  ///< Not zero: a packed, tiled or compressed layout of the vendor.
  std::string name;            ///< As printed by `cam --list`.
};

/// Empty if no PixelFormat has this memory layout. DRM names packed colours from the highest byte of a little-endian
/// word: its BGR888 is r, g, b in memory (rgb8), and its RGB888 is b, g, r, which is not supported.
[[nodiscard]] std::optional<PixelFormat> format_of(std::uint32_t fourcc, std::uint64_t modifier);

/// Index into `offered`: the wanted format; if `wanted` is empty, the first of nv12, yuyv, rgb8, then raw Bayer with
/// the most bits. failed_precondition lists the offered formats.
[[nodiscard]] Result<std::size_t> choose_format(std::span<const SupportedFormat> offered,
                                                std::optional<PixelFormat> wanted);

}  // namespace lightwell::libcam
