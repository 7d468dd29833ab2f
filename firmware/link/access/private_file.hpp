// Files and folders that are for their owner alone.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <lightwell/result.hpp>

namespace lightwell {

/// Makes the folder (mode 0700) and those above it where they are missing. failed_precondition where others may write
/// in it.
[[nodiscard]] Status make_private_folder(const std::string& path);

/// Mode 0600, on the disk when this returns; a reader sees the old content or the new, never a part. Written by root it
/// belongs to the owner of its folder.
[[nodiscard]] Status write_private_file(const std::string& path, std::string_view text);
/// Nothing where there is no such file. resource_exhausted above a mebibyte.
[[nodiscard]] Result<std::optional<std::string>> read_private_file(const std::string& path);

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
