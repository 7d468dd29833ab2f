#include "measure/picture_codecs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <jpeglib.h>

#include <lightwell/pixel.hpp>

namespace lightwell::measure {
namespace {

struct ErrorManager {
  jpeg_error_mgr base{};
  std::jmp_buf jump{};
};

void leave(j_common_ptr codec) { std::longjmp(reinterpret_cast<ErrorManager*>(codec->err)->jump, 1); }

bool encode(std::span<const std::uint8_t> rgb, int width, int height, JpegSetting setting, unsigned char** memory,
            unsigned long* bytes) {
  ErrorManager errors;
  jpeg_compress_struct codec;
  codec.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = leave;
  if (setjmp(errors.jump) != 0) {
    jpeg_destroy_compress(&codec);
    return false;
  }
  jpeg_create_compress(&codec);
  jpeg_mem_dest(&codec, memory, bytes);
  codec.image_width = static_cast<JDIMENSION>(width);
  codec.image_height = static_cast<JDIMENSION>(height);
  codec.input_components = 3;
  codec.in_color_space = JCS_RGB;
  jpeg_set_defaults(&codec);
  jpeg_set_quality(&codec, setting.quality, TRUE);
  codec.optimize_coding = TRUE;
  codec.comp_info[0].h_samp_factor = codec.comp_info[0].v_samp_factor = setting.subsampled ? 2 : 1;
  jpeg_simple_progression(&codec);
  jpeg_start_compress(&codec, TRUE);
  while (codec.next_scanline < codec.image_height) {
    JSAMPROW row = const_cast<JSAMPROW>(rgb.data()) +
                   static_cast<std::size_t>(codec.next_scanline) * 3 * static_cast<std::size_t>(width);
    jpeg_write_scanlines(&codec, &row, 1);
  }
  jpeg_finish_compress(&codec);
  jpeg_destroy_compress(&codec);
  return true;
}

bool decode(const unsigned char* memory, unsigned long bytes, std::vector<std::uint8_t>& rgb) {
  ErrorManager errors;
  jpeg_decompress_struct codec;
  codec.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = leave;
  if (setjmp(errors.jump) != 0) {
    jpeg_destroy_decompress(&codec);
    return false;
  }
  jpeg_create_decompress(&codec);
  jpeg_mem_src(&codec, memory, bytes);
  jpeg_read_header(&codec, TRUE);
  codec.out_color_space = JCS_RGB;
  jpeg_start_decompress(&codec);
  const std::size_t stride = std::size_t{3} * codec.output_width;
  rgb.resize(stride * codec.output_height);
  while (codec.output_scanline < codec.output_height) {
    JSAMPROW row = rgb.data() + codec.output_scanline * stride;
    jpeg_read_scanlines(&codec, &row, 1);
  }
  jpeg_finish_decompress(&codec);
  jpeg_destroy_decompress(&codec);
  return true;
}

std::vector<std::uint8_t> content_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

std::vector<std::uint8_t> codes_of(const std::vector<Radiance>& picture) {
  std::vector<std::uint8_t> out;
  out.reserve(3 * picture.size());
  for (const Radiance& p : picture)
    for (int c = 0; c < 3; ++c)
      out.push_back(static_cast<std::uint8_t>(
          std::lround(255 * linear_to_srgb(std::clamp(static_cast<double>(p[c]), 0.0, 1.0)))));
  return out;
}

std::vector<Radiance> picture_of(std::span<const std::uint8_t> codes) {
  static const std::array<float, 256> kLinear = [] {
    std::array<float, 256> table{};
    for (std::size_t i = 0; i < 256; ++i) table[i] = static_cast<float>(srgb_to_linear(static_cast<double>(i) / 255));
    return table;
  }();
  std::vector<Radiance> out(codes.size() / 3);
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = {kLinear[codes[3 * i]], kLinear[codes[3 * i + 1]], kLinear[codes[3 * i + 2]]};
  return out;
}

std::optional<CodedPicture> code_jpeg(std::span<const std::uint8_t> rgb, int width, int height, JpegSetting setting) {
  unsigned char* memory = nullptr;
  unsigned long bytes = 0;
  CodedPicture out;
  const bool good = encode(rgb, width, height, setting, &memory, &bytes) && decode(memory, bytes, out.rgb);
  out.bytes = bytes;
  std::free(memory);
  if (!good) return std::nullopt;
  return out;
}

std::optional<CodedPicture> code_x264(std::span<const std::uint8_t> frames, int width, int height, int crf,
                                      const std::string& folder) {
  const std::string raw = folder + "/frames.rgb", coded = folder + "/frames.h264", decoded = folder + "/decoded.rgb";
  {
    std::ofstream file(raw, std::ios::binary);
    file.write(reinterpret_cast<const char*>(frames.data()), static_cast<std::streamsize>(frames.size()));
  }
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  const std::string quiet = "ffmpeg -y -loglevel quiet ";
  const std::string encoding = quiet + "-f rawvideo -pix_fmt rgb24 -s " + size + " -r 30 -i '" + raw +
                               "' -c:v libx264 -preset slow -pix_fmt yuv444p -crf " + std::to_string(crf) +
                               " -f h264 '" + coded + "'";
  const std::string decoding = quiet + "-i '" + coded + "' -f rawvideo -pix_fmt rgb24 '" + decoded + "'";
  CodedPicture out;
  if (std::system(encoding.c_str()) == 0 && std::system(decoding.c_str()) == 0) {
    out.bytes = content_of(coded).size();
    out.rgb = content_of(decoded);
  }
  for (const std::string& path : {raw, coded, decoded}) std::filesystem::remove(path);
  if (out.rgb.size() != frames.size()) return std::nullopt;
  return out;
}

}  // namespace lightwell::measure
