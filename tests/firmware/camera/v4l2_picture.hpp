// What the test's camera sees: an even orange, in any of the encodings that cameras send.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lightwell::test {

/// Without padding.
[[nodiscard]] std::size_t packed_row_bytes(std::uint32_t fourcc, int width);
[[nodiscard]] std::size_t encoded_bytes(std::uint32_t fourcc, std::size_t row_bytes, int width, int height);

/// Red is `level` of full scale, green half, blue a quarter of it; luma formats have `level` in luma. The last pixels
/// of the last row tell `number`, so that no two frames are alike. Returns the bytes that were used.
std::size_t draw_picture(std::uint32_t fourcc, int width, int height, std::size_t row_bytes, double level,
                         std::uint32_t number, std::span<std::byte> out);

/// A JPEG of grey `value`, with the luma of its last block taken from `number`. As motion JPEG: `with_tables` false
/// leaves the Huffman tables out, as cameras do.
[[nodiscard]] std::vector<std::byte> draw_jpeg(int width, int height, int value, std::uint32_t number,
                                               bool with_tables);

/// One of smooth noise, with its tables; chroma has one sample for so many columns and rows.
[[nodiscard]] std::vector<std::byte> draw_noise_jpeg(int width, int height, unsigned seed, int columns, int rows);

}  // namespace lightwell::test
