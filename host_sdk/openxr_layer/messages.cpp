#include "messages.hpp"

#include <algorithm>
#include <cstdio>

#include "configuration.hpp"

namespace lightwell::xr {

/// A bound for errors with changing texts, such as of a link that fails in many ways over days.
constexpr std::size_t kMaxReported = 64;

void Messages::error(const char* function, const std::string& text) {
  {
    const std::lock_guard lock(mutex_);
    if (reported_.size() >= kMaxReported || std::ranges::find(reported_, text) != reported_.end()) return;
    reported_.push_back(text);
  }
  if (!has_messenger_ || runtime_.submit_message == nullptr) {
    std::fprintf(stderr, "%s: %s: %s\n", kLayerName, function, text.c_str());
    return;
  }
  XrDebugUtilsMessengerCallbackDataEXT data{};
  data.type = XR_TYPE_DEBUG_UTILS_MESSENGER_CALLBACK_DATA_EXT;
  data.messageId = kLayerName;
  data.functionName = function;
  data.message = text.c_str();
  runtime_.submit_message(runtime_.instance, XR_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
                          XR_DEBUG_UTILS_MESSAGE_TYPE_GENERAL_BIT_EXT, &data);
}

}  // namespace lightwell::xr
