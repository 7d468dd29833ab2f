#include <ImathBox.h>
#include <exception>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfVersion.h>
#include <OpenEXR/ImfXdr.h>

#include "imaging/image_readers.hpp"

namespace lightwell {
namespace {

/// Reads the header of the first part alone: Imf::InputFile would allocate tables before the size can be checked.
Imf::Header first_header(const std::string& path) {
  Imf::StdIFStream stream(path.c_str());
  int magic = 0, version = 0;
  Imf::Xdr::read<Imf::StreamIO>(stream, magic);
  Imf::Xdr::read<Imf::StreamIO>(stream, version);
  Imf::Header header;
  header.readFrom(stream, version);
  return header;
}

enum class Colors { rgb, grey };

Result<Colors> check_header(const std::string& path, const Imf::Header& header) {
  const Imath::Box2i& data = header.dataWindow();
  const Imath::Box2i& display = header.displayWindow();
  const auto side = [](int low, int high) { return std::int64_t{high} - low + 1; };
  if (Status s = check_image_size(path, side(data.min.x, data.max.x), side(data.min.y, data.max.y)); !s.ok()) return s;
  if (data != display)
    return image_refused(path,
                         "a data window that is not the display window: part of the picture "
                         "is missing or hidden; export it whole");
  if (header.hasType() && !Imf::isImage(header.type())) return image_refused(path, "deep samples; flatten it");
  if (header.hasTileDescription() &&
      header.tileDescription().xSize * std::int64_t{1} * header.tileDescription().ySize > kMaxImagePixels)
    return image_refused(path, "tiles of more than 64 megapixels");

  const Imf::ChannelList& channels = header.channels();
  for (auto c = channels.begin(); c != channels.end(); ++c)
    if (c.channel().xSampling != 1 || c.channel().ySampling != 1)
      return image_refused(path, std::string("channel ") + c.name() + " is subsampled; export it as plain RGB");
  const bool any_color = channels.findChannel("R") != nullptr || channels.findChannel("G") != nullptr ||
                         channels.findChannel("B") != nullptr;
  if (!any_color && channels.findChannel("Y") != nullptr) {
    if (channels.findChannel("RY") != nullptr || channels.findChannel("BY") != nullptr)
      return image_refused(path, "luminance and chroma channels; export it as plain RGB");
    return Colors::grey;
  }
  for (const char* name : {"R", "G", "B"})
    if (channels.findChannel(name) == nullptr)
      return image_refused(
          path, std::string("no channel ") + name + "; export it with R, G and B, or Y alone, unnamed layer");
  return Colors::rgb;
}

Imf::FrameBuffer frame_buffer(Image& image, const Imath::Box2i& window, Colors colors) {
  constexpr std::size_t kFloat = sizeof(float);
  Imf::FrameBuffer buffer;
  const char* const names[] = {"R", "G", "B"};
  const std::size_t count = colors == Colors::grey ? 1 : 3;
  for (std::size_t c = 0; c < count; ++c)
    buffer.insert(colors == Colors::grey ? "Y" : names[c],
                  Imf::Slice::Make(Imf::FLOAT, image.data.data() + c * kFloat, window, 3 * kFloat, image.stride()));
  return buffer;
}

void copy_first_channel(Image& image) {
  constexpr std::size_t kFloat = sizeof(float);
  for (std::size_t at = 0; at < image.data.size(); at += 3 * kFloat)
    for (std::size_t k = 0; k < 2 * kFloat; ++k) image.data[at + kFloat + k] = image.data[at + k % kFloat];
}

}  // namespace

Result<Image> read_exr(const std::string& path) {
  try {
    const Imf::Header header = first_header(path);
    const Result<Colors> colors = check_header(path, header);
    if (!colors) return colors.status();
    const Imath::Box2i window = header.dataWindow();

    Imf::InputFile file(path.c_str());
    if (!file.isComplete()) return image_truncated(path, "OpenEXR misses rows that its header promises");
    Image image{window.max.x - window.min.x + 1, window.max.y - window.min.y + 1, PixelFormat::rgb_f32, {}};
    image.data.resize(image.stride() * static_cast<std::size_t>(image.height));
    file.setFrameBuffer(frame_buffer(image, window, *colors));
    file.readPixels(window.min.y, window.max.y);
    if (*colors == Colors::grey) copy_first_channel(image);
    return image;
  } catch (const std::exception& e) {
    return image_damaged(path, std::string("OpenEXR says: ") + e.what());
  }
}

}  // namespace lightwell
