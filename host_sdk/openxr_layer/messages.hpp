// Messages to the developer or user of the application.
#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "runtime.hpp"

namespace lightwell::xr {

/// Reports errors to the application's XR_EXT_debug_utils messengers if it has enabled that extension, otherwise on
/// stderr. A text is reported once, because an application repeats its mistake in every frame. Any thread.
class Messages {
 public:
  explicit Messages(const Runtime& runtime) : runtime_(runtime) {}

  /// `function`: the OpenXR function that is concerned.
  void error(const char* function, const std::string& text);

 private:
  const Runtime& runtime_;
  std::mutex mutex_;
  std::vector<std::string> reported_;  ///< At most kMaxReported; later texts are dropped.
};

}  // namespace lightwell::xr
