// A file that is part of the program.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace lightwell {

/// Both members are valid as long as those who use them.
struct StaticFile {
  std::string_view path;  ///< "/index.html".
  std::span<const std::byte> bytes;
};

/// The files of the dashboard that are part of this program.
[[nodiscard]] std::span<const StaticFile> dashboard_files();

}  // namespace lightwell
