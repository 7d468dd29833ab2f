#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>

#include <lightwell/files.hpp>

namespace lightwell {

Result<std::string> read_text_file(const std::string& path) {
  std::ifstream in(path_of(path), std::ios::binary);
  if (!in) return Status(StatusCode::not_found, path + ": cannot be opened: " + std::strerror(errno));
  std::string text;
  for (std::array<char, 8192> part; in.read(part.data(), part.size()) || in.gcount() > 0;)
    text.append(part.data(), static_cast<std::size_t>(in.gcount()));
  if (in.bad()) return Status(StatusCode::data_loss, path + ": cannot be read to its end");
  return text;
}

}  // namespace lightwell
