// Pictures in memory and in files. Rows from the top.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell::viewer {

/// R, G, B, A for each pixel, linear.
struct Picture {
  int width = 0, height = 0;
  std::vector<float> rgba;

  [[nodiscard]] bool empty() const { return rgba.empty(); }
  void resize(int w, int h) {
    width = w;
    height = h;
    rgba.resize(4 * static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
  }
  [[nodiscard]] const float* at(int column, int row) const {
    return rgba.data() +
           4 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column));
  }
  [[nodiscard]] float* at(int column, int row) {
    return const_cast<float*>(static_cast<const Picture&>(*this).at(column, row));  // NOLINT: of this object
  }
};

/// R, G, B for each pixel, sRGB codes, or other values for a normal map.
struct BytePicture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;

  [[nodiscard]] bool empty() const { return rgb.empty(); }
};

/// IEC 61966-2-1. The code of a linear value, 0 to 1, rounded, and the linear value of a code:
/// srgb_code(srgb_linear(c)) is c.
[[nodiscard]] std::uint8_t srgb_code(float linear);
[[nodiscard]] float srgb_linear(std::uint8_t code);

/// Largest width and height of a picture that is read.
inline constexpr int kMaxPictureSide = 16384;
/// Largest file of a PNG or JPEG picture.
inline constexpr std::size_t kMaxPictureBytes = std::size_t{256} << 20U;

// not_found, data_loss, resource_exhausted or invalid_argument name the file.
/// PNG or JPEG, 8 bit.
[[nodiscard]] Result<BytePicture> read_bytes(const std::string& path);
/// The same from memory, for textures in files.
[[nodiscard]] Result<BytePicture> decode_bytes(const std::uint8_t* data, std::size_t size);
/// OpenEXR, R G B.
[[nodiscard]] Result<Picture> read_exr(const std::string& path);
/// sRGB, 8 bit, without A.
[[nodiscard]] Status write_png(const std::string& path, const Picture& picture);
/// OpenEXR, 32 bit float, R G B A.
[[nodiscard]] Status write_exr(const std::string& path, const Picture& picture);

}  // namespace lightwell::viewer
