// Draws the picture of the simulated V4L2 device, uniform orange, in all encodings.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lightwell::test {

/// Bytes per row without padding.
[[nodiscard]] std::size_t packed_row_bytes(std::uint32_t fourcc, int width);
[[nodiscard]] std::size_t encoded_bytes(std::uint32_t fourcc, std::size_t row_bytes, int width, int height);

/// Red is `level` of full scale, green half and blue a quarter of it; luma formats have `level` in luma. `number` is
/// encoded in some pixels near the end, so that all frames differ. Returns the number of bytes used.
std::size_t draw_picture(std::uint32_t fourcc, int width, int height, std::size_t row_bytes, double level,
                         std::uint32_t number, std::span<std::byte> out);

/// A JPEG of grey `value`; the luma of its last block depends on `number`. `with_tables` false omits the Huffman
/// tables, as cameras do in Motion JPEG.
[[nodiscard]] std::vector<std::byte> draw_jpeg(int width, int height, int value, std::uint32_t number,
                                               bool with_tables);

/// A JPEG of smooth noise, with tables; chroma has one sample per `columns` x `rows` pixels.
[[nodiscard]] std::vector<std::byte> draw_noise_jpeg(int width, int height, unsigned seed, int columns, int rows);

}  // namespace lightwell::test
