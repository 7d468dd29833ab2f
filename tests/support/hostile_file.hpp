// Objects that an attacker may place where a file is expected, and the victim file that links point to.
#pragma once

#include <array>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "support/read_file.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {

enum class HostileFileKind { symbolic_link, dangling_link, hard_link, fifo, folder };
inline constexpr std::array kHostileFileKinds{HostileFileKind::symbolic_link, HostileFileKind::dangling_link,
                                              HostileFileKind::hard_link, HostileFileKind::fifo,
                                              HostileFileKind::folder};
inline std::string to_string(HostileFileKind kind) {
  return std::array{"symbolic link", "dangling link", "hard link", "FIFO", "folder"}[static_cast<std::size_t>(kind)];
}

class HostileFile {
 public:
  HostileFile() : victim_(folder_.write("victim", "root's")) { before_ = facts(); }

  void set(HostileFileKind kind, const std::string& path) const {
    switch (kind) {
      case HostileFileKind::symbolic_link:
        return std::filesystem::create_symlink(victim_, path);
      case HostileFileKind::dangling_link:
        return std::filesystem::create_symlink(folder_.path("nothing"), path);
      case HostileFileKind::hard_link:
        return std::filesystem::create_hard_link(victim_, path);
      case HostileFileKind::fifo:
        ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0) << path;
        return;
      case HostileFileKind::folder:
        std::filesystem::create_directory(path);
    }
  }

  /// Owner, mode and content of the victim are unchanged, the dangling link's target was not created, and `path` still
  /// exists. `what` is added to failure messages.
  void expect_untouched(const std::string& path, const std::string& what) const {
    const struct stat now = facts();
    EXPECT_EQ(now.st_uid, before_.st_uid) << what;
    EXPECT_EQ(now.st_mode, before_.st_mode) << what;
    EXPECT_EQ(read_file(victim_), "root's") << what;
    EXPECT_FALSE(std::filesystem::exists(folder_.path("nothing"))) << what;
    EXPECT_TRUE(std::filesystem::exists(std::filesystem::symlink_status(path))) << what;
  }

 private:
  [[nodiscard]] struct stat facts() const {
    struct stat s {};
    EXPECT_EQ(::stat(victim_.c_str(), &s), 0);
    return s;
  }
  TempDir folder_;
  std::string victim_;
  struct stat before_ {};
};

}  // namespace lightwell::test
