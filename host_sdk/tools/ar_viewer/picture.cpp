#include "ar_viewer/picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <lightwell/pixel.hpp>

namespace lightwell::viewer {
namespace {

constexpr std::array kChannels = {"R", "G", "B", "A"};

/// OpenEXR throws; the viewer's libraries return a status.
template <class F>
Status without_exceptions(const std::string& path, const F& f) {
  try {
    return f();
  } catch (const std::exception& e) {
    return {StatusCode::data_loss, path + ": " + e.what()};
  }
}

Result<BytePicture> bytes_of(cv::Mat decoded) {
  if (decoded.empty()) return Status(StatusCode::data_loss, "not a PNG or JPEG picture that OpenCV can read");
  if (decoded.cols > kMaxPictureSide || decoded.rows > kMaxPictureSide)
    return invalid_argument("the picture is larger than " + std::to_string(kMaxPictureSide) + " pixels");
  cv::cvtColor(decoded, decoded, cv::COLOR_BGR2RGB);
  BytePicture picture{decoded.cols, decoded.rows, {}};
  picture.rgb.assign(decoded.datastart, decoded.dataend);
  return picture;
}

}  // namespace

std::uint8_t srgb_code(float linear) {
  return static_cast<std::uint8_t>(
      std::lround(255 * linear_to_srgb(std::clamp(static_cast<double>(linear), 0.0, 1.0))));
}

float srgb_linear(std::uint8_t code) {
  static const std::array<float, 256> kTable = [] {
    std::array<float, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i)
      table[i] = static_cast<float>(srgb_to_linear(static_cast<double>(i) / 255));
    return table;
  }();
  return kTable[code];
}

Result<BytePicture> read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Status(StatusCode::not_found, path + ": the picture cannot be opened");
  std::error_code error;
  if (std::filesystem::file_size(path, error) > kMaxPictureBytes || error)
    return Status(StatusCode::resource_exhausted,
                  path + ": no file of at most " + std::to_string(kMaxPictureBytes >> 20U) + " MiB");
  const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
  Result<BytePicture> picture =
      decode_bytes(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());  // NOLINT
  if (!picture.ok()) return picture.status().in(path);
  return picture;
}

Result<BytePicture> decode_bytes(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return Status(StatusCode::data_loss, "the picture is empty");
  try {
    return bytes_of(cv::imdecode(cv::Mat(1, static_cast<int>(size), CV_8U, const_cast<std::uint8_t*>(data)),  // NOLINT
                                 cv::IMREAD_COLOR));
  } catch (const cv::Exception& e) {
    return Status(StatusCode::data_loss, e.what());
  }
}

Result<Picture> read_exr(const std::string& path) {
  if (!std::ifstream(path)) return Status(StatusCode::not_found, path + ": the picture cannot be opened");
  Picture picture;
  const Status status = without_exceptions(path, [&]() -> Status {
    Imf::InputFile file(path.c_str());
    const Imath::Box2i window = file.header().dataWindow();
    const int width = window.max.x - window.min.x + 1, height = window.max.y - window.min.y + 1;
    if (width < 1 || height < 1 || width > kMaxPictureSide || height > kMaxPictureSide)
      return invalid_argument(path + ": the picture is larger than " + std::to_string(kMaxPictureSide) + " pixels");
    if (file.header().channels().findChannel("R") == nullptr)
      return invalid_argument(path + ": the picture has no channel R; write R, G and B");
    picture.resize(width, height);
    const std::size_t row = 4 * sizeof(float) * static_cast<std::size_t>(width);
    // OpenEXR addresses pixels by their coordinates in the data window.
    char* origin = reinterpret_cast<char*>(picture.rgba.data()) -
                   4 * sizeof(float) * static_cast<std::ptrdiff_t>(window.min.x) -
                   static_cast<std::ptrdiff_t>(row) * window.min.y;  // NOLINT
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < 4; ++c)
      buffer.insert(kChannels[c], Imf::Slice(Imf::FLOAT, origin + c * sizeof(float), 4 * sizeof(float), row, 1, 1,
                                             c == 3 ? 1.0 : 0.0));
    file.setFrameBuffer(buffer);
    file.readPixels(window.min.y, window.max.y);
    return {};
  });
  if (!status.ok()) return status;
  return picture;
}

Status write_png(const std::string& path, const Picture& picture) {
  cv::Mat encoded(picture.height, picture.width, CV_8UC3);
  for (int row = 0; row < picture.height; ++row)
    for (int column = 0; column < picture.width; ++column) {
      const float* p = picture.at(column, row);
      encoded.at<cv::Vec3b>(row, column) = {srgb_code(p[2]), srgb_code(p[1]), srgb_code(p[0])};
    }
  try {
    if (cv::imwrite(path, encoded)) return {};
  } catch (const cv::Exception&) {  // Said below.
  }
  return {StatusCode::failed_precondition, path + ": the picture cannot be written"};
}

Status write_exr(const std::string& path, const Picture& picture) {
  return without_exceptions(path, [&]() -> Status {
    Imf::Header header(picture.width, picture.height);
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < 4; ++c) {
      header.channels().insert(kChannels[c], Imf::Channel(Imf::FLOAT));
      char* first = reinterpret_cast<char*>(const_cast<float*>(picture.rgba.data() + c));  // NOLINT: OpenEXR only reads
      buffer.insert(kChannels[c], Imf::Slice(Imf::FLOAT, first, 4 * sizeof(float),
                                             4 * sizeof(float) * static_cast<std::size_t>(picture.width)));
    }
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(buffer);
    file.writePixels(picture.height);
    return {};
  });
}

}  // namespace lightwell::viewer
