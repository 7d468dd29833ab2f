#include <array>
#include <cerrno>
#include <cstring>

#include <lightwell/files.hpp>

namespace lightwell {

Result<std::string> read_text_file(const std::string& path) {
  const Result<FilePointer> file = open_for_reading(path);
  if (!file) return Status(StatusCode::not_found, path + ": cannot be opened: " + std::strerror(errno));
  std::string text;
  std::array<char, 8192> part;
  while (const std::size_t size = std::fread(part.data(), 1, part.size(), file->get())) text.append(part.data(), size);
  // Not a std::ifstream: that of libc++ reads a folder as an empty file.
  if (std::ferror(file->get()) != 0) return Status(StatusCode::data_loss, path + ": cannot be read to its end");
  return text;
}

}  // namespace lightwell
