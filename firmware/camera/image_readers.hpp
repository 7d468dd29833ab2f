// Behind read_image: one reader a kind of file. Private to this folder.
//   Each takes `name` for messages and returns a picture whose values are the file's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <lightwell/result.hpp>

#include "camera/image_file.hpp"

namespace lightwell {

/// A picture with more pixels, or a longer side, is refused before memory is asked for.
inline constexpr std::int64_t kMaxImagePixels = std::int64_t{64} << 20;
inline constexpr std::int64_t kMaxImageSide = 65536;

/// invalid_argument for a size that no camera of ours has.
[[nodiscard]] Status check_image_size(const std::string& name, std::int64_t width, std::int64_t height);

[[nodiscard]] Status image_truncated(const std::string& name, const std::string& where);
[[nodiscard]] Status image_damaged(const std::string& name, const std::string& where);
[[nodiscard]] Status image_refused(const std::string& name, const std::string& why);

[[nodiscard]] Result<Image> read_png(const std::string& name, std::span<const std::byte> file);
[[nodiscard]] Result<Image> read_jpeg(const std::string& name, std::span<const std::byte> file);
[[nodiscard]] Result<Image> read_hdr(const std::string& name, std::span<const std::byte> file);
/// Reads the file by its path: OpenEXR seeks in it.
[[nodiscard]] Result<Image> read_exr(const std::string& path);

/// PNG and JPEG once their structure is known to be whole: 8-bit r, g, b in the order of the file's
/// rows. EXIF orientation is ignored on purpose: a calibration speaks of the sensor's pixels.
[[nodiscard]] Result<Image> decode_png(const std::string& name, std::span<const std::byte> file);
[[nodiscard]] Result<Image> decode_jpeg(const std::string& name, std::span<const std::byte> file);
[[nodiscard]] Result<std::vector<std::byte>> encode_png(const Image& image);

}  // namespace lightwell
