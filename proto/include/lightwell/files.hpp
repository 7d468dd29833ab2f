// Files in folders that other users may write in: what is opened is a file and no trap, what is written is there whole
// or not at all, and both outlast a power cut.
//
// A path is followed one component at a time, each relative to the folder that was opened before it, so that nothing
// can be exchanged in between. A symbolic link on the way is followed where root or this process's user made it, and
// refused where somebody else did: root would read or write wherever that user points it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <lightwell/result.hpp>

namespace lightwell {

/// Makes the folder (mode 0700) and those above it where they are missing. failed_precondition where it is a symbolic
/// link, belongs to another user (root may work for any), or where others may write in it.
[[nodiscard]] Status make_private_folder(const std::string& path);

enum class FileMode : std::uint8_t {
  owner,  ///< Mode 0600.
  umask,  ///< As other programs make files.
};
/// Writes beside `path`, flushes to the disk, renames and flushes the folder: a reader, or a power cut, sees the old
/// file or the new one. Written by root it belongs to the owner of its folder. A character device (/dev/null) is
/// written to; failed_precondition for what else is no regular file.
[[nodiscard]] Status write_atomically(const std::string& path, std::string_view bytes, FileMode readers);

/// The bytes of a file as somebody named it in a configuration; symbolic links are followed as above. Nothing where
/// there is no such file; failed_precondition for what is no regular file (a FIFO would wait for its writer),
/// resource_exhausted above a mebibyte.
[[nodiscard]] Result<std::optional<std::string>> read_named_file(const std::string& path);
/// The same for a file of a private folder: no symbolic link, one name, and of the folder's owner or root.
[[nodiscard]] Result<std::optional<std::string>> read_private_file(const std::string& path);

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using FilePointer = std::unique_ptr<std::FILE, CloseFile>;
/// To be read and written; made empty where there is none. failed_precondition for what is neither a regular file nor a
/// character device, and for a file with a second name, which may be somebody else's.
[[nodiscard]] Result<FilePointer> open_for_update(const std::string& path);
/// Leaves the first `bytes` of it and writes on from there.
[[nodiscard]] Status truncate_file(std::FILE* file, std::uint64_t bytes);

/// A new folder with a name that nobody knows, for its owner alone.
[[nodiscard]] Result<std::string> make_folder_beside(const std::string& path);
/// Puts the folder `made`, whose files were written by write_atomically(), in the place of `path`, and removes what was
/// there. A reader, or a power cut, sees the old folder or the new one.
[[nodiscard]] Status replace_folder(const std::string& made, const std::string& path);

/// One process at a time, from construction to destruction; waits for its turn.
class FolderLock {
 public:
  [[nodiscard]] static Result<FolderLock> take(const std::string& folder);
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&&) = delete;
  ~FolderLock();

 private:
  explicit FolderLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

}  // namespace lightwell
