#include "tools/lightwell_calibrate/output.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <iostream>
#include <unistd.h>

#include <sys/stat.h>

namespace lightwell::calibrate {

namespace {

bool flush_folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool done = ::fsync(descriptor) == 0;
  ::close(descriptor);
  return done;
}

}  // namespace

Status write_atomically(const std::string& path, std::string_view bytes) {
  const auto failed = [&](const std::string& what) {
    return Status(StatusCode::data_loss, path + ": " + what + ": " + std::strerror(errno));
  };
  std::string temporary = path + ".XXXXXX";
  const int file = ::mkstemp(temporary.data());
  if (file < 0) return failed("cannot be written, no file can be made beside it");
  const auto give_up = [&](const std::string& what) {
    const Status s = failed(what);
    ::close(file);
    ::unlink(temporary.c_str());
    return s;
  };
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = ::write(file, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return give_up("cannot be written");
    done += static_cast<std::size_t>(n);
  }
  // mkstemp's file is its owner's alone; what is replaced was made under the umask.
  const mode_t mask = ::umask(0);
  ::umask(mask);
  if (::fchmod(file, 0666 & ~mask) != 0 || ::fsync(file) != 0) return give_up("cannot be written");
  if (::close(file) != 0 || std::rename(temporary.c_str(), path.c_str()) != 0) {
    const Status s = failed("cannot be replaced");
    ::unlink(temporary.c_str());
    return s;
  }
  // Without this the new name may be lost with the power, though what it names is on the disk.
  if (!flush_folder_of(path)) return failed("is in its place, but the disk did not confirm it");
  return {};
}

Status write_output(const std::string& path, std::string_view bytes) {
  if (path != "-") return write_atomically(path, bytes);
  std::cout << bytes << std::flush;
  return std::cout ? Status() : Status(StatusCode::data_loss, "standard output cannot be written");
}

}  // namespace lightwell::calibrate
