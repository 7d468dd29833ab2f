#include "link/access/private_file.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <unistd.h>
#include <utility>

#include <sys/file.h>
#include <sys/stat.h>

namespace lightwell {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 20;

/// Closes what it was given.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  [[nodiscard]] int get() const { return number_; }

 private:
  int number_;
};

Status failed(const std::string& path, const char* what) {
  const int error = errno;
  return {error == ENOSPC || error == EDQUOT ? StatusCode::resource_exhausted : StatusCode::failed_precondition,
          path + ": " + what + ": " + std::strerror(error)};
}

bool write_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(descriptor, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

/// What an administrator's `lightwelld --pair` writes belongs to the daemon's user, as the folder does: else the daemon
/// could not read it.
bool give_to_owner_of(const std::string& folder, int descriptor) {
  if (::geteuid() != 0) return true;
  struct stat facts {};
  return ::stat(folder.c_str(), &facts) == 0 && ::fchown(descriptor, facts.st_uid, facts.st_gid) == 0;
}

std::string folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

}  // namespace

Status make_private_folder(const std::string& path) {
  std::error_code error;
  const std::filesystem::path folder(path);
  if (folder.has_parent_path()) std::filesystem::create_directories(folder.parent_path(), error);
  if (error) return {StatusCode::failed_precondition, path + ": cannot be made: " + error.message()};
  if (::mkdir(path.c_str(), S_IRWXU) != 0 && errno != EEXIST) return failed(path, "cannot be made");
  struct stat facts {};
  if (::stat(path.c_str(), &facts) != 0) return failed(path, "cannot be looked at");
  if (!S_ISDIR(facts.st_mode)) return {StatusCode::failed_precondition, path + ": is no folder"};
  if ((facts.st_mode & (S_IWGRP | S_IWOTH)) != 0)
    return {StatusCode::failed_precondition,
            path + ": others may write there, and could put keys of their own in it; `chmod 700` it"};
  return {};
}

Status write_private_file(const std::string& path, std::string_view text) {
  std::string beside = path + ".XXXXXX";
  {
    const Descriptor file(::mkostemp(beside.data(), O_CLOEXEC));  // mode 0600
    if (file.get() < 0) return failed(path, "cannot be written");
    if (!write_all(file.get(), text) || !give_to_owner_of(folder_of(path), file.get()) || ::fsync(file.get()) != 0) {
      const Status s = failed(path, "cannot be written");
      ::unlink(beside.c_str());
      return s;
    }
  }
  if (::rename(beside.c_str(), path.c_str()) != 0) {
    const Status s = failed(path, "cannot be put in its place");
    ::unlink(beside.c_str());
    return s;
  }
  // The name, too, is to outlast a power cut.
  const Descriptor folder(::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.get() < 0 || ::fsync(folder.get()) != 0)
    return failed(path, "is in its place, but the disk did not confirm it");
  return {};
}

Result<std::optional<std::string>> read_private_file(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) {
    if (errno == ENOENT) return std::optional<std::string>();
    return failed(path, "cannot be read");
  }
  std::string text;
  std::array<char, 8192> buffer;
  for (;;) {
    const ssize_t n = ::read(file.get(), buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return failed(path, "cannot be read");
    if (n == 0) return std::optional<std::string>(std::move(text));
    text.append(buffer.data(), static_cast<std::size_t>(n));
    if (text.size() > kMaxBytes)
      return Status(StatusCode::resource_exhausted, path + ": is larger than a mebibyte, which no file of keys is");
  }
}

Result<FolderLock> FolderLock::take(const std::string& folder) {
  const std::string path = folder + "/lock";
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (descriptor < 0) return failed(path, "cannot be opened");
  if (!give_to_owner_of(folder, descriptor)) {
    const Status s = failed(path, "cannot be given to the folder's owner");
    ::close(descriptor);
    return s;
  }
  while (::flock(descriptor, LOCK_EX) != 0) {
    if (errno == EINTR) continue;
    const Status s = failed(path, "cannot be locked");
    ::close(descriptor);
    return s;
  }
  return FolderLock(descriptor);
}

FolderLock::FolderLock(FolderLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace lightwell
