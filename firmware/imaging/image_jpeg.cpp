#include <algorithm>

#include "imaging/image_readers.hpp"
#include "imaging/jpeg_decoder.hpp"

namespace lightwell {
namespace {

Status status_of(const std::string& name, const JpegDecoder& decoder) {
  const std::string where = std::string("libjpeg says: ") + decoder.message();
  switch (decoder.fault()) {
    case JpegDecoder::Fault::cut_off:
      return image_truncated(name, where);
    case JpegDecoder::Fault::damaged:
      return image_damaged(name, where);
    case JpegDecoder::Fault::unsupported:
      break;
  }
  return image_refused(name, where + "; save it as a baseline JPEG of 8 bits and up to 64 megapixels");
}

/// Whether the bytes after the end marker are legitimate: cameras append a second picture (MPF) or pad with zeros.
/// Anything else is the rest of a scan with a premature end marker.
bool may_follow_the_end(std::span<const std::byte> rest) {
  if (rest.size() >= 2 && rest[0] == std::byte{0xFF} && rest[1] == std::byte{0xD8}) return true;
  return std::ranges::all_of(rest, [](std::byte b) { return b == std::byte{0}; });
}

}  // namespace

Result<Image> read_jpeg(const std::string& name, std::span<const std::byte> file) {
  JpegDecoder decoder;
  JpegDecoder::Header header;
  if (!decoder.read_header(file, header)) return status_of(name, decoder);
  if (Status s = check_image_size(name, header.width, header.height); !s.ok()) return s;
  if (header.components != 1 && header.components != 3)
    return image_refused(name,
                         "a JPEG of " + std::to_string(header.components) + " components (CMYK?); save it as RGB");
  if (header.arithmetic) return image_refused(name, "a JPEG with arithmetic codes; save it as baseline");
  Image image{header.width, header.height, PixelFormat::rgb8, {}};
  image.data.resize(image.stride() * static_cast<std::size_t>(image.height));
  if (!decoder.decode(image.data)) return status_of(name, decoder);
  if (const std::span<const std::byte> rest = decoder.rest(); !may_follow_the_end(rest))
    return image_damaged(name,
                         "the JPEG's end marker comes " + std::to_string(rest.size()) + " bytes before the file ends");
  return image;
}

}  // namespace lightwell
