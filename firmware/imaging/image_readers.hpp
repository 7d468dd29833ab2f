// The readers behind read_image(), one per file format. Private to this folder. `name` is the file's name for messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <lightwell/result.hpp>

#include "imaging/image_file.hpp"

namespace lightwell {

/// Limits of an image, checked before memory is allocated.
inline constexpr std::int64_t kMaxImagePixels = std::int64_t{64} << 20;
inline constexpr std::int64_t kMaxImageSide = 65536;

/// invalid_argument for a size that is not positive or beyond the limits.
[[nodiscard]] Status check_image_size(const std::string& name, std::int64_t width, std::int64_t height);

[[nodiscard]] Status image_truncated(const std::string& name, const std::string& where);
[[nodiscard]] Status image_damaged(const std::string& name, const std::string& where);
[[nodiscard]] Status image_refused(const std::string& name, const std::string& why);

/// 8-bit r, g, b. EXIF orientation is ignored, because a calibration refers to the sensor's pixels.
[[nodiscard]] Result<Image> read_png(const std::string& name, std::span<const std::byte> file);
[[nodiscard]] Result<Image> read_jpeg(const std::string& name, std::span<const std::byte> file);
[[nodiscard]] Result<Image> read_hdr(const std::string& name, std::span<const std::byte> file);
/// Takes a path, because OpenEXR seeks in the file.
[[nodiscard]] Result<Image> read_exr(const std::string& path);

}  // namespace lightwell
