// Measures the time that the v4l2 backend takes to convert a driver's buffer to an image, and of memcpy of that image
// in the same run: 1280x960 of a real room through a fisheye. Prints one JSON object per line for tests/figures:
// figure, value (time relative to memcpy), ms, memcpy_gb_per_s, bytes (of the driver's buffer).
//   measure_converters PANORAMA
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <jpeglib.h>  // Needs <cstdio> before it.
#include <string>
#include <vector>

#include <linux/videodev2.h>

#include "camera/backends/v4l2/formats.hpp"
#include "measure/output.hpp"
#include "measure/shots.hpp"
#include "sim/panorama.hpp"
#include "sim/sensor.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;

constexpr int kWidth = 1280, kHeight = 960;
/// More buffers than any cache holds, and enough passes for a good minimum per buffer.
constexpr std::size_t kBuffers = 32;
constexpr int kPasses = 5;
/// JPEG quality of a typical webcam; chroma is subsampled horizontally (4:2:2), as by webcams.
constexpr int kJpegQuality = 85;

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "measure_converters: %s\n", what.c_str());
  std::exit(1);
}

double seconds_of(auto&& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

std::vector<std::byte> motion_jpeg(std::span<const std::byte> rgb) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* out = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &out, &size);
  jpeg.image_width = kWidth;
  jpeg.image_height = kHeight;
  jpeg.input_components = 3;
  jpeg.in_color_space = JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, kJpegQuality, TRUE);
  jpeg.comp_info[0].h_samp_factor = 2;
  jpeg.comp_info[0].v_samp_factor = 1;
  jpeg_start_compress(&jpeg, TRUE);
  std::vector<unsigned char> row(3UL * kWidth);
  for (std::size_t y = 0; y < kHeight; ++y) {
    std::memcpy(row.data(), rgb.data() + y * row.size(), row.size());
    JSAMPROW rows[] = {row.data()};
    jpeg_write_scanlines(&jpeg, rows, 1);
  }
  jpeg_finish_compress(&jpeg);
  const auto* bytes = reinterpret_cast<const std::byte*>(out);
  std::vector<std::byte> coded(bytes, bytes + size);
  jpeg_destroy_compress(&jpeg);
  std::free(out);
  return coded;
}

/// Random bytes: the time to unpack does not depend on the content.
std::vector<std::byte> noise(std::size_t bytes) {
  std::vector<std::byte> all(bytes);
  std::uint32_t state = 1;
  for (std::byte& b : all) b = static_cast<std::byte>((state = state * 1664525U + 1013904223U) >> 24);
  return all;
}

void measure_one(const char* name, std::uint32_t fourcc, std::size_t bytes_per_line,
                 const std::vector<std::byte>& driver) {
  const v4l2::Encoding* encoding = v4l2::encoding_of(fourcc);
  if (encoding == nullptr) fail(std::string(name) + " is not a supported encoding");
  const auto layout = v4l2::layout_of(*encoding, kWidth, kHeight, bytes_per_line, driver.size(), false);
  if (!layout) fail(layout.status().message());
  v4l2::Converter converter(*encoding, *layout);
  const std::vector<std::vector<std::byte>> from(kBuffers, driver);
  std::vector<std::vector<std::byte>> to(kBuffers, std::vector<std::byte>(layout->picture_bytes));
  std::vector<double> converting(kBuffers, 1e9), copying(kBuffers, 1e9);
  for (int pass = 0; pass < kPasses; ++pass) {
    for (std::size_t k = 0; k < kBuffers; ++k)
      converting[k] = std::min(converting[k], seconds_of([&] {
                                 if (!converter.convert(from[k], to[k]))
                                   fail(std::string(name) + ": the image is incomplete");
                               }));
    for (std::size_t k = 0; k < kBuffers; ++k)
      copying[k] = std::min(
          copying[k], seconds_of([&] { std::memcpy(to[(k + 1) % kBuffers].data(), to[k].data(), to[k].size()); }));
  }
  double convert_s = 0, copy_s = 0;
  for (std::size_t k = 0; k < kBuffers; ++k) convert_s += converting[k] / kBuffers, copy_s += copying[k] / kBuffers;
  measure::print_figure(std::string("convert.") + name, convert_s / copy_s,
                        {{"ms", 1e3 * convert_s},
                         {"memcpy_gb_per_s", static_cast<double>(layout->picture_bytes) / copy_s * 1e-9},
                         {"bytes", static_cast<double>(driver.size())}});
}

}  // namespace

int main(int argc, char** argv) {
  std::string path;
  CLI::App app{"Time in which the v4l2 backend converts a driver's buffer, relative to memcpy of the image.",
               "measure_converters"};
  app.add_option("PANORAMA", path, "Panorama that the camera sees")->required();
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  Result<sim::Panorama> panorama = sim::load_panorama(path);
  if (!panorama) fail(panorama.status().message());
  const sim::Scene scene(std::move(*panorama));
  const Result<RigParameters> rig = sim::make_rig("single", kWidth, kHeight, PixelFormat::rgb8);
  if (!rig) fail(rig.status().message());
  measure::Camera camera(*rig, PixelFormat::rgb8);
  const measure::LensRadiance seen = camera.render(scene, scene.state_at(0));
  // The middle exposure of a bracket, as a webcam would expose.
  const std::vector<double> exposures = camera.bracket_of_three(measure::peak_of(seen), measure::mean_of(seen));
  const measure::Shot shot = camera.expose(seen, exposures, 0);

  constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;
  measure_one("packed10", V4L2_PIX_FMT_SRGGB10P, kWidth * 5 / 4, noise(kPixels * 5 / 4));
  measure_one("packed12", V4L2_PIX_FMT_SRGGB12P, kWidth * 3 / 2, noise(kPixels * 3 / 2));
  measure_one("grey", V4L2_PIX_FMT_GREY, kWidth, noise(kPixels));
  measure_one("mjpeg", V4L2_PIX_FMT_MJPEG, 0, motion_jpeg(shot.pixels[1]));
}
