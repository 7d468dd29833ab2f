// A temporary folder that is deleted with the object.
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

#include <gtest/gtest.h>

namespace lightwell::test {

class TempDir {
 public:
  TempDir() {
    std::random_device random;
    std::error_code error;
    do {
      folder_ = std::filesystem::temp_directory_path() / ("lightwell_" + std::to_string(random()));
    } while (!std::filesystem::create_directory(folder_, error) && !error);
    if (error) ADD_FAILURE() << "no temporary folder " << folder_ << ": " << error.message();
    std::filesystem::permissions(folder_, std::filesystem::perms::owner_all, error);
  }
  TempDir(const TempDir&) = delete;
  TempDir& operator=(const TempDir&) = delete;
  ~TempDir() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }

  /// Writes a file and returns its path.
  std::string write(const std::string& name, std::string_view text) const {
    std::ofstream(path(name), std::ios::binary) << text;
    return path(name);
  }
  std::string write(const std::string& name, std::span<const std::byte> bytes) const {
    return write(name, std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace lightwell::test
