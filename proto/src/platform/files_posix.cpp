// lightwell/files.hpp by POSIX and Linux: openat(), O_PATH, renameat2().
#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <stdio.h>
#include <unistd.h>
#include <vector>

#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>

#include <lightwell/files.hpp>

namespace lightwell {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;
/// The kernel's limit (MAXSYMLINKS).
constexpr int kMaxLinksFollowed = 40;

Status failed(const std::string& path, const char* what) {
  const int error = errno;
  const StatusCode code = is_disk_full(error) ? StatusCode::resource_exhausted
                          : error == ENOENT   ? StatusCode::not_found
                                              : StatusCode::failed_precondition;
  return {code, path + ": " + what + ": " + std::strerror(error)};
}

Status refused_path(const std::string& path, const char* why) {
  return {StatusCode::failed_precondition, path + ": " + why};
}

bool is_ours(uid_t owner) { return owner == 0 || owner == ::geteuid(); }

/// An entry of an open folder. openat() with O_NOFOLLOW opens this entry or fails.
struct Place {
  FileDescriptor folder;  ///< O_PATH
  std::string name = ".";
};

enum class FinalLink : std::uint8_t { follow, refuse };
enum class Parents : std::uint8_t { expect, make };

/// Pushes the components of `path` in reverse order: `names` is a stack with the next component at its end.
void push_names(std::vector<std::string>& names, std::string_view path) {
  const auto at = static_cast<std::ptrdiff_t>(names.size());
  while (!path.empty()) {
    const std::string_view name = path.substr(0, path.find('/'));
    if (!name.empty() && name != ".") names.emplace_back(name);
    path.remove_prefix(std::min(path.size(), name.size() + 1));
  }
  std::reverse(names.begin() + at, names.end());
}

FileDescriptor start_of(std::string_view path) {
  constexpr int kFlags = O_PATH | O_DIRECTORY | O_CLOEXEC;
  if (!path.starts_with('/')) return FileDescriptor(::open(".", kFlags));
  // The root of this process, even if the path "/" is mapped: qemu-user with -L maps it to the sysroot.
  const int root = ::open("/proc/self/root", kFlags);
  return FileDescriptor(root >= 0 ? root : ::open("/", kFlags));
}

Result<Place> find(const std::string& path, FinalLink final_link, Parents parents = Parents::expect,
                   const char* failure = "cannot be reached") {
  std::vector<std::string> left;
  push_names(left, path);
  Place at{start_of(path)};
  for (int links = 0; at.folder && !left.empty();) {
    at.name = std::move(left.back());
    left.pop_back();
    if (left.empty() && final_link == FinalLink::refuse) return at;
    FileDescriptor step(::openat(at.folder.get(), at.name.c_str(), O_PATH | O_NOFOLLOW | O_CLOEXEC));
    if (!step && errno == ENOENT) {
      if (left.empty()) return at;
      if (parents == Parents::make && ::mkdirat(at.folder.get(), at.name.c_str(), 0777) == 0) {
        left.push_back(std::move(at.name));
        continue;
      }
    }
    struct stat facts {};
    if (!step || ::fstat(step.get(), &facts) != 0) return failed(path, failure);
    if (S_ISLNK(facts.st_mode)) {
      if (!is_ours(facts.st_uid))
        return refused_path(path, ("'" + at.name +
                                   "' in this path is a symbolic link that another user made; use the path to which "
                                   "it points")
                                      .c_str());
      std::array<char, PATH_MAX> target{};
      const ssize_t size = ::readlinkat(step.get(), "", target.data(), target.size());
      if (size < 0 || ++links > kMaxLinksFollowed) return refused_path(path, "too many symbolic links in this path");
      const std::string_view to(target.data(), static_cast<std::size_t>(size));
      push_names(left, to);
      if (to.starts_with('/')) at.folder = start_of(to);
    } else if (left.empty()) {
      return at;
    } else {
      at.folder = std::move(step);
    }
    at.name = ".";
  }
  if (!at.folder) return failed(path, failure);
  return at;
}

FileDescriptor open_at(const Place& place, int flags, mode_t mode = 0) {
  // O_NONBLOCK: otherwise open() of a FIFO blocks until its other end is opened.
  return FileDescriptor(
      ::openat(place.folder.get(), place.name.c_str(), flags | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, mode));
}

/// The error of a failed open(). For a symbolic link O_NOFOLLOW fails with ELOOP (with O_DIRECTORY: ENOTDIR).
Status cannot_open(const std::string& path) {
  if (errno == ELOOP)
    return refused_path(path, "is a symbolic link, which is not followed here; put the file itself there");
  return failed(path, "cannot be opened");
}

enum class Names : std::uint8_t { any, one };

/// Checks that `file` is a regular file; with Names::one, also that it has one hard link and belongs to root, to this
/// user, or to the folder's owner, who can write there anyway.
Status check_plain(const FileDescriptor& file, const Place& place, const std::string& path, Names names) {
  struct stat facts {
  }, folder{};
  if (::fstat(file.get(), &facts) != 0 || ::fstat(place.folder.get(), &folder) != 0)
    return failed(path, "cannot be examined");
  if (!S_ISREG(facts.st_mode)) return refused_path(path, "is not a regular file; remove it");
  if (names == Names::any) return {};
  if (facts.st_nlink != 1)
    return refused_path(path, "has a second hard link and may be another user's file; remove it");
  if (!is_ours(facts.st_uid) && facts.st_uid != folder.st_uid)
    return refused_path(path, "belongs neither to its folder's owner nor to this user; remove it or `chown` it");
  return {};
}

/// A character device such as /dev/null; only root can create one.
bool is_device(const FileDescriptor& file) {
  struct stat facts {};
  return ::fstat(file.get(), &facts) == 0 && S_ISCHR(facts.st_mode);
}

/// If root writes (`lightwelld --pair`), gives the new file or folder to the owner of its folder: otherwise the
/// daemon's user could not read it. `made` must have been created by this process: an existing file never changes its
/// owner.
bool chown_to_owner_of(const FileDescriptor& folder, const FileDescriptor& made) {
  if (::geteuid() != 0) return true;
  struct stat facts {};
  return ::fstat(folder.get(), &facts) == 0 && ::fchown(made.get(), facts.st_uid, facts.st_gid) == 0;
}

bool flush_folder(const FileDescriptor& folder) {
  const FileDescriptor open(::openat(folder.get(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return open && ::fsync(open.get()) == 0;
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

/// A temporary name, unique within this process. O_EXCL and mkdir detect a collision with another process.
std::string beside(const std::string& name) {
  static std::atomic<unsigned> count{0};
  return "." + name.substr(0, 200) + "." + std::to_string(::getpid()) + "." + std::to_string(count++);
}

constexpr int kAttempts = 100;

mode_t process_umask() {
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return mask;
}

Result<std::optional<std::string>> read_file(const std::string& path, FinalLink final_link, Names names) {
  const Result<Place> place = find(path, final_link);
  if (!place && place.status().code() == StatusCode::not_found) return std::optional<std::string>();
  if (!place) return place.status();
  const FileDescriptor file = open_at(*place, O_RDONLY);
  if (!file && errno == ENOENT) return std::optional<std::string>();
  if (!file) return cannot_open(path);
  if (Status s = check_plain(file, *place, path, names); !s.ok()) return s;
  std::string text;
  std::array<char, 8192> buffer;
  for (;;) {
    const ssize_t n = ::read(file.get(), buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return failed(path, "cannot be read");
    if (n == 0) return std::optional<std::string>(std::move(text));
    text.append(buffer.data(), static_cast<std::size_t>(n));
    if (text.size() > kMaxFileBytes)
      return Status(StatusCode::resource_exhausted, path + ": is larger than the limit of 1 MiB");
  }
}

}  // namespace

FileDescriptor::~FileDescriptor() {
  if (number_ >= 0) ::close(number_);
}

Status make_private_folder(const std::string& path) {
  const Result<Place> place = find(path, FinalLink::refuse, Parents::make);
  if (!place) return place.status();
  const bool made = ::mkdirat(place->folder.get(), place->name.c_str(), S_IRWXU) == 0;
  if (!made && errno != EEXIST) return failed(path, "cannot be created");
  const FileDescriptor folder = open_at(*place, O_RDONLY | O_DIRECTORY);
  if (!folder)
    return errno == ENOTDIR || errno == ELOOP ? refused_path(path,
                                                             "is not a folder; remove it, or, if it is a symbolic "
                                                             "link, use the path of the folder itself")
                                              : failed(path, "cannot be opened");
  struct stat facts {};
  if (::fstat(folder.get(), &facts) != 0) return failed(path, "cannot be examined");
  if ((facts.st_mode & (S_IWGRP | S_IWOTH)) != 0)
    return refused_path(path, "is writable by other users, who could place keys in it; `chmod 700` it");
  if (::geteuid() != 0 && facts.st_uid != ::geteuid())
    return refused_path(path, "belongs to another user, who could place keys in it; `chown` it");
  if (made && facts.st_uid == ::geteuid() && !chown_to_owner_of(place->folder, folder))
    return failed(path, "cannot be given to the owner of the folder above it");
  return {};
}

Status write_atomically(const std::string& path, std::string_view bytes, FileMode readers) {
  const Result<Place> place = find(path, FinalLink::follow, Parents::expect, "cannot be written");
  if (!place) return place.status();
  const int folder = place->folder.get();
  struct stat there {};
  if (::fstatat(folder, place->name.c_str(), &there, AT_SYMLINK_NOFOLLOW) == 0 && !S_ISREG(there.st_mode)) {
    if (!S_ISCHR(there.st_mode))
      return refused_path(path, "is not a regular file and is not replaced; remove it or name another file");
    const FileDescriptor device = open_at(*place, O_WRONLY);
    return device && write_all(device.get(), bytes) ? Status() : failed(path, "cannot be written");
  }
  Place aside{FileDescriptor(::openat(folder, ".", O_PATH | O_DIRECTORY | O_CLOEXEC))};
  FileDescriptor file(-1);
  for (int i = 0; i < kAttempts && !file; ++i) {
    aside.name = beside(place->name);
    file = open_at(aside, O_WRONLY | O_CREAT | O_EXCL, S_IRUSR | S_IWUSR);
    if (!file && errno != EEXIST) break;
  }
  if (!file) return failed(path, "cannot be written, no file can be created beside it");
  const mode_t mode = readers == FileMode::owner ? S_IRUSR | S_IWUSR : 0666 & ~process_umask();
  const bool written = write_all(file.get(), bytes) && chown_to_owner_of(place->folder, file) &&
                       ::fchmod(file.get(), mode) == 0 && ::fsync(file.get()) == 0;
  if (!written || ::renameat(folder, aside.name.c_str(), folder, place->name.c_str()) != 0) {
    const Status s = failed(path, written ? "cannot be replaced" : "cannot be written");
    ::unlinkat(folder, aside.name.c_str(), 0);
    return s;
  }
  // Without this a power failure can lose the new directory entry although the file's data are on the disk.
  if (!flush_folder(place->folder)) return failed(path, "is in its place, but the disk did not confirm it");
  return {};
}

Result<std::optional<std::string>> read_named_file(const std::string& path) {
  return read_file(path, FinalLink::follow, Names::any);
}

Result<std::optional<std::string>> read_private_file(const std::string& path) {
  return read_file(path, FinalLink::refuse, Names::one);
}

Result<FilePointer> open_for_update(const std::string& path) {
  const Result<Place> place = find(path, FinalLink::follow);
  if (!place) return place.status();
  FileDescriptor file = open_at(*place, O_RDWR | O_CREAT, 0666);
  if (!file) return cannot_open(path);
  if (const Status s = check_plain(file, *place, path, Names::one); !s.ok() && !is_device(file)) return s;
  FilePointer out(::fdopen(file.get(), "r+b"));
  if (!out) return failed(path, "cannot be opened");
  (void)file.release();
  return out;
}

Result<FilePointer> open_for_reading(const std::string& path) {
  FilePointer file(std::fopen(path.c_str(), "rb"));
  if (!file) return Status(StatusCode::not_found, path + ": " + std::strerror(errno));
  return file;
}

std::uint64_t file_position(std::FILE* file) {
  const off_t position = ::ftello(file);
  return position < 0 ? 0 : static_cast<std::uint64_t>(position);
}

bool is_disk_full(int error) { return error == ENOSPC || error == EFBIG || error == EDQUOT; }

std::string configuration_folder() {
  const auto set = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string(value == nullptr ? "" : value);
  };
  if (std::string config = set("XDG_CONFIG_HOME"); !config.empty()) return config;
  if (const std::string home = set("HOME"); !home.empty()) return home + "/.config";
  return {};
}

Status truncate_file(std::FILE* file, std::uint64_t bytes) {
  const auto size = static_cast<off_t>(bytes);
  if (std::fflush(file) == 0 && ::ftruncate(::fileno(file), size) == 0 && ::fseeko(file, size, SEEK_SET) == 0)
    return {};
  return failed("the file", "cannot be truncated");
}

Result<std::string> make_folder_beside(const std::string& path) {
  const Result<Place> place = find(path, FinalLink::refuse);
  if (!place) return place.status();
  for (int i = 0; i < kAttempts; ++i) {
    const std::string name = beside(place->name);
    if (::mkdirat(place->folder.get(), name.c_str(), S_IRWXU) == 0)
      return (std::filesystem::path(path).parent_path() / name).string();
    if (errno != EEXIST) break;
  }
  return failed(path, "no folder can be created beside it");
}

Status replace_folder(const std::string& made, const std::string& path) {
  const Result<Place> from = find(made, FinalLink::refuse), to = find(path, FinalLink::refuse);
  if (!from || !to) return from ? to.status() : from.status();
  const auto rename = [&](unsigned flags) {
    // Some C libraries have no renameat2() (musl before 1.2.6, Android before API level 30).
    return ::syscall(SYS_renameat2, from->folder.get(), from->name.c_str(), to->folder.get(), to->name.c_str(),
                     flags) == 0;
  };
  constexpr unsigned kExchange = 2;  // RENAME_EXCHANGE of linux/fs.h.
  const bool exchanged = rename(kExchange);
  // If there is nothing to exchange, it is renamed, which replaces at most an empty folder.
  if (!exchanged && (errno != ENOENT || !rename(0))) return failed(path, "cannot be replaced");
  if (!flush_folder(to->folder)) return failed(path, "is in its place, but the disk did not confirm it");
  std::error_code ignored;
  if (exchanged) std::filesystem::remove_all(made, ignored);
  return {};
}

Result<FolderLock> FolderLock::take(const std::string& folder) {
  const std::string path = folder + "/lock";
  const Result<Place> place = find(path, FinalLink::refuse);
  if (!place) return place.status();
  FileDescriptor file = open_at(*place, O_RDWR | O_CREAT | O_EXCL, S_IRUSR | S_IWUSR);
  if (file) {
    if (!chown_to_owner_of(place->folder, file)) return failed(path, "cannot be given to the folder's owner");
  } else {
    if (errno == EEXIST) file = open_at(*place, O_RDWR);
    if (!file) return cannot_open(path);
    if (const Status s = check_plain(file, *place, path, Names::one); !s.ok()) return s;
  }
  while (::flock(file.get(), LOCK_EX) != 0)
    if (errno != EINTR) return failed(path, "cannot be locked");
  return FolderLock(std::move(file));
}

}  // namespace lightwell
