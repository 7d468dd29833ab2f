#include "imaging/image_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <span>
#include <string_view>

#include <sys/stat.h>

#include <lightwell/files.hpp>

#include "imaging/image_readers.hpp"

namespace lightwell {
namespace {

constexpr std::int64_t kMaxFileBytes = std::int64_t{1} << 30;

Status io_error(const std::string& path, int error) {
  const StatusCode code = error == ENOENT || error == ENOTDIR                    ? StatusCode::not_found
                          : error == ENOSPC || error == EFBIG || error == EDQUOT ? StatusCode::resource_exhausted
                                                                                 : StatusCode::failed_precondition;
  return {code, path + ": " + std::strerror(error)};
}

Result<std::vector<std::byte>> read_whole(const std::string& path) {
  // Check the type before opening: opening a pipe would block until somebody writes to it.
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return io_error(path, errno);
  if (!S_ISREG(info.st_mode)) return image_refused(path, "not a file");
  if (info.st_size > kMaxFileBytes) return image_refused(path, "larger than 1 GiB");
  const FilePointer file(std::fopen(path.c_str(), "rb"));
  if (!file) return io_error(path, errno);
  std::vector<std::byte> bytes(static_cast<std::size_t>(info.st_size));
  errno = 0;
  const std::size_t got = std::fread(bytes.data(), 1, bytes.size(), file.get());
  if (got != bytes.size() && std::ferror(file.get()) != 0) return io_error(path, errno);
  bytes.resize(got);
  return bytes;
}

bool starts_with(std::span<const std::byte> file, std::string_view magic) {
  return file.size() >= magic.size() && std::memcmp(file.data(), magic.data(), magic.size()) == 0;
}

}  // namespace

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

Status image_refused(const std::string& name, const std::string& why) {
  return {StatusCode::invalid_argument, name + ": " + why};
}

Result<Image> read_image(const std::string& path) {
  const Result<std::vector<std::byte>> file = read_whole(path);
  if (!file) return file.status();
  if (file->empty()) return image_truncated(path, "it is empty");
  if (starts_with(*file, "\x89PNG")) return read_png(path, *file);
  if (starts_with(*file, "\xFF\xD8")) return read_jpeg(path, *file);
  if (starts_with(*file, "\x76\x2F\x31\x01")) return read_exr(path);
  if (starts_with(*file, "#?RADIANCE") || starts_with(*file, "#?RGBE")) return read_hdr(path, *file);
  return image_refused(path, "not a PNG, JPEG, OpenEXR or Radiance HDR picture; convert it to one");
}

Status write_png(const std::string& path, const Image& image) {
  const Result<std::vector<std::byte>> png = encode_png(image);
  if (!png) return {png.status().code(), path + ": " + png.status().message()};
  return write_atomically(path, {reinterpret_cast<const char*>(png->data()), png->size()}, FileMode::umask);
}

}  // namespace lightwell
