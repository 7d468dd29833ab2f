#include "usb_camera/jpeg_encoder.hpp"

#include <csetjmp>
#include <cstdlib>
#include <string>

#include "imaging/jpeg_errors.hpp"

namespace lightwell::usb_camera {

namespace {

/// Encodes at one quality. `memory`: allocated by libjpeg, `bytes`: its size. This function has no objects with
/// destructors, because libjpeg's errors leave it by longjmp().
bool compress(const std::byte* rgb, FrameSize size, int quality, JpegErrors& errors, unsigned char** memory,
              unsigned long* bytes) {
  jpeg_compress_struct info{};
  info.err = errors.install();
  if (setjmp(errors.jump) != 0) {
    jpeg_destroy_compress(&info);
    return false;
  }
  jpeg_create_compress(&info);
  jpeg_mem_dest(&info, memory, bytes);
  info.image_width = static_cast<JDIMENSION>(size.width);
  info.image_height = static_cast<JDIMENSION>(size.height);
  info.input_components = 3;
  info.in_color_space = JCS_RGB;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, quality, TRUE);
  info.comp_info[0].h_samp_factor = 2;
  info.comp_info[0].v_samp_factor = 1;
  // The integer DCT gives identical bits on all machines.
  info.dct_method = JDCT_ISLOW;
  jpeg_start_compress(&info, TRUE);
  while (info.next_scanline < info.image_height) {
    // libjpeg does not write to its input, although the parameter is not const.
    auto* row = reinterpret_cast<JSAMPROW>(const_cast<std::byte*>(rgb)) +
                3 * static_cast<std::size_t>(info.next_scanline) * static_cast<std::size_t>(size.width);
    jpeg_write_scanlines(&info, &row, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  return true;
}

}  // namespace

Result<std::vector<std::byte>> encode_jpeg(std::span<const std::byte> rgb, FrameSize size, int quality,
                                           std::size_t max_bytes) {
  for (;; quality -= 5) {
    JpegErrors errors;
    unsigned char* memory = nullptr;
    unsigned long bytes = 0;
    const bool done = compress(rgb.data(), size, quality, errors, &memory, &bytes);
    const auto* const begin = reinterpret_cast<const std::byte*>(memory);
    std::vector<std::byte> out;
    if (done && bytes <= max_bytes) out.assign(begin, begin + bytes);
    std::free(memory);
    if (!done) return Status(StatusCode::internal, std::string("JPEG: ") + errors.message.data());
    if (!out.empty()) return out;
    if (quality <= 5)
      return Status(StatusCode::internal,
                    "JPEG: the image exceeds " + std::to_string(max_bytes) + " bytes even at the lowest quality");
  }
}

}  // namespace lightwell::usb_camera
