// Messages to the developer or user of the application.
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <vector>

#include "runtime.hpp"

namespace lightwell::xr {

/// Reports errors to the application's messengers of XR_EXT_debug_utils if it has created one, otherwise on stderr. The
/// list of enabled extensions does not tell: the loader removes that extension where the runtime lacks it, and serves
/// it itself. A text is reported once, because an application repeats its mistake in every frame. Any thread.
class Messages {
 public:
  explicit Messages(const Runtime& runtime) : runtime_(runtime) {}

  /// From now on the application has a messenger.
  void use_messengers() { has_messenger_ = true; }

  /// `function`: the OpenXR function that is concerned.
  void error(const char* function, const std::string& text);

 private:
  const Runtime& runtime_;
  std::atomic<bool> has_messenger_ = false;
  std::mutex mutex_;
  std::vector<std::string> reported_;  ///< At most kMaxReported; later texts are dropped.
};

}  // namespace lightwell::xr
