// Safe access to files in folders in which other users may write. Reading refuses FIFOs, devices and foreign symbolic
// links; writing is atomic and durable across a power failure.
//
// A path is resolved one component at a time with openat(), relative to the folder opened before, so that no component
// can be exchanged in between. A symbolic link is followed if root or this process's user made it and refused
// otherwise, because another user could direct root to any file.
//
// Windows: a path is UTF-8. What only its owner may access has an access list of this user, the administrators and the
// system in place of a mode. Making a link takes a privilege there, so a path is resolved as a whole; a link in the
// last place is refused where it is refused elsewhere, too.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <lightwell/result.hpp>

namespace lightwell {

/// A file descriptor of the C library, closed with the object. A negative number is no descriptor.
class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int number) : number_(number) {}
  FileDescriptor(FileDescriptor&& other) noexcept : number_(other.release()) {}
  /// Swaps: `other` closes the descriptor that this object had.
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~FileDescriptor();

  [[nodiscard]] int get() const { return number_; }
  explicit operator bool() const { return number_ >= 0; }
  /// Returns the descriptor and no longer owns it.
  [[nodiscard]] int release() { return std::exchange(number_, -1); }

 private:
  int number_ = -1;
};

/// A path of this API as one of the standard library, which takes the characters of a std::string in the locale's
/// encoding on Windows.
[[nodiscard]] inline std::filesystem::path path_of(std::string_view utf8) {
  return {std::u8string(utf8.begin(), utf8.end())};
}
[[nodiscard]] inline std::string text_of(const std::filesystem::path& path) {
  const std::u8string utf8 = path.u8string();
  return {utf8.begin(), utf8.end()};
}

/// Creates the folder (mode 0700) and missing parents. failed_precondition if it is a symbolic link, belongs to another
/// user (root may use any user's), or is writable by others.
[[nodiscard]] Status make_private_folder(const std::string& path);

/// Reads a whole file that the user named. not_found if it cannot be opened, data_loss if it cannot be read to its end,
/// for example a folder; the message names the path.
[[nodiscard]] Result<std::string> read_text_file(const std::string& path);

enum class FileMode : std::uint8_t {
  owner,  ///< Mode 0600.
  umask,  ///< Mode 0666 & ~umask.
};
/// Writes a temporary file beside `path`, syncs it, renames it and syncs the folder: readers, also after a power
/// failure, see either the old or the new file. If root writes, the file belongs to the owner of its folder. A
/// character device (/dev/null) is written directly; failed_precondition for any other file that is not regular.
[[nodiscard]] Status write_atomically(const std::string& path, std::string_view bytes, FileMode readers);

/// Content of a file named in a configuration; symbolic links are followed as above. No value if there is no such file;
/// failed_precondition if it is not a regular file (opening a FIFO would block), resource_exhausted above 1 MiB.
[[nodiscard]] Result<std::optional<std::string>> read_named_file(const std::string& path);
/// The same for a file in a private folder: not a symbolic link, one hard link, owned by the folder's owner or by root.
[[nodiscard]] Result<std::optional<std::string>> read_private_file(const std::string& path);

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using FilePointer = std::unique_ptr<std::FILE, CloseFile>;
/// Opens a file for reading and writing, or creates an empty one. failed_precondition if it is neither a regular file
/// nor a character device, or has a second hard link, which may be another user's file.
[[nodiscard]] Result<FilePointer> open_for_update(const std::string& path);
/// Opens a file for reading; not_found if that fails.
[[nodiscard]] Result<FilePointer> open_for_reading(const std::string& path);
/// Bytes from the beginning of the file to the position of reading and writing; files may be larger than 2 GiB.
[[nodiscard]] std::uint64_t file_position(std::FILE* file);
/// Whether `error`, of errno, means that the disk or this user's share of it is full, or the file may not be larger.
[[nodiscard]] bool is_disk_full(int error);
/// Truncates the file to `bytes` and sets the write position there.
[[nodiscard]] Status truncate_file(std::FILE* file, std::uint64_t bytes);

/// Creates a folder with an unpredictable name beside `path`, accessible to its owner only.
[[nodiscard]] Result<std::string> make_folder_beside(const std::string& path);
/// Replaces `path` by the folder `made`, whose files were written by write_atomically(), and removes the old content.
/// Readers, also after a power failure, see either the old or the new folder. Windows cannot exchange two folders: for
/// a moment there is none.
[[nodiscard]] Status replace_folder(const std::string& made, const std::string& path);

/// The folder in which programs keep what this user configured: XDG_CONFIG_HOME or ~/.config, on Windows LOCALAPPDATA.
/// Empty if the environment names none.
[[nodiscard]] std::string configuration_folder();

/// Exclusive lock of a folder among processes, held from construction to destruction; take() waits for it.
class FolderLock {
 public:
  [[nodiscard]] static Result<FolderLock> take(const std::string& folder);

 private:
  explicit FolderLock(FileDescriptor lock) : lock_(std::move(lock)) {}
  FileDescriptor lock_;
};

}  // namespace lightwell
