#include "imaging/image_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <span>

#include <sys/stat.h>

#include <lightwell/files.hpp>

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

constexpr std::int64_t kMaxFileBytes = std::int64_t{1} << 30;

Result<std::string> read_whole(const std::string& path) {
  const auto failed = [&path] {
    const StatusCode code =
        errno == ENOENT || errno == ENOTDIR ? StatusCode::not_found : StatusCode::failed_precondition;
    return Status(code, path + ": " + std::strerror(errno));
  };
  // Check the type before opening: opening a pipe would block until somebody writes to it.
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return failed();
  if (!S_ISREG(info.st_mode)) return image_refused(path, "not a file");
  if (info.st_size > kMaxFileBytes) return image_refused(path, "larger than 1 GiB");
  const FilePointer file(std::fopen(path.c_str(), "rb"));
  if (!file) return failed();
  std::string bytes(static_cast<std::size_t>(info.st_size), '\0');
  bytes.resize(std::fread(bytes.data(), 1, bytes.size(), file.get()));
  if (std::ferror(file.get()) != 0) return failed();
  return bytes;
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

Status check_image_size(const std::string& name, std::int64_t width, std::int64_t height) {
  if (width > 0 && height > 0 && width <= kMaxImageSide && height <= kMaxImageSide && width * height <= kMaxImagePixels)
    return {};
  return image_refused(name, "a size of " + std::to_string(width) + " x " + std::to_string(height) +
                                 "; up to 64 megapixels are read, scale it down");
}

Status image_truncated(const std::string& name, const std::string& where) {
  return {StatusCode::data_loss, name + ": cut off, " + where + "; copy or export the file again"};
}

Status image_damaged(const std::string& name, const std::string& where) {
  return {StatusCode::data_loss, name + ": damaged, " + where + "; copy or export the file again"};
}

Status image_refused(const std::string& name, const std::string& why) { return invalid_argument(name + ": " + why); }

Result<Image> read_image(const std::string& path) {
  const Result<std::string> file = read_whole(path);
  if (!file) return file.status();
  if (file->empty()) return image_truncated(path, "it is empty");
  const std::span<const std::byte> bytes = std::as_bytes(std::span(*file));
  if (file->starts_with("\x89PNG")) return read_png(path, bytes);
  if (file->starts_with("\xFF\xD8")) return read_jpeg(path, bytes);
  if (file->starts_with("\x76\x2F\x31\x01")) return read_exr(path);
  if (file->starts_with("#?RADIANCE") || file->starts_with("#?RGBE")) return read_hdr(path, bytes);
  return image_refused(path, "not a PNG, JPEG, OpenEXR or Radiance HDR picture; convert it to one");
}

}  // namespace lightwell
