// The table of camera backends in this build.
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "imaging/uri.hpp"

namespace lightwell {

struct BackendEntry {
  std::string_view scheme;
  std::string_view help;  ///< One line for `lightwelld --cameras`.
  Result<std::unique_ptr<CameraBackend>> (*make)(const CameraUri&, const CameraConfig&);
};

[[nodiscard]] std::span<const BackendEntry> backend_table();

/// Creates the backend for the scheme of config.uri. not_found: an unknown scheme; the message lists the known ones.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_backend(const CameraConfig& config);

}  // namespace lightwell
