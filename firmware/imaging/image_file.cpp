#include "imaging/image_file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <span>
#include <string>

#include <sys/stat.h>

#include <lightwell/files.hpp>

#include "imaging/image_readers.hpp"

namespace lightwell {
namespace {

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
