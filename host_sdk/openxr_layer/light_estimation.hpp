// The functions of XR_ANDROID_light_estimation and XR_ANDROID_light_estimation_cubemap.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "instance.hpp"

namespace lightwell::xr {

/// The function of an enabled extension, null for another name.
[[nodiscard]] PFN_xrVoidFunction light_estimation_function(const Instance& instance, std::string_view name);

/// The layer's structures in the chain of an XrSystemProperties. They are out of the chain while this lives, because
/// layers below may refuse structures of extensions that are not enabled for them.
class SystemPropertiesChain {
 public:
  /// Both outlive this.
  SystemPropertiesChain(const Instance& instance, XrSystemProperties& properties);
  /// Restores the chain.
  ~SystemPropertiesChain();
  SystemPropertiesChain(const SystemPropertiesChain&) = delete;
  SystemPropertiesChain& operator=(const SystemPropertiesChain&) = delete;

  /// The chain has no end, or more of the layer's structures than two of each type.
  [[nodiscard]] bool is_loop() const { return is_loop_; }
  /// Sets whether the system supports light estimation and cube maps.
  void fill() const;

 private:
  struct Removed {
    XrBaseOutStructure** slot;  ///< Where the pointer to it was.
    XrBaseOutStructure* structure;
  };

  const Instance& instance_;
  std::array<Removed, 4> removed_{};
  std::size_t count_ = 0;
  bool is_loop_ = false;
};

}  // namespace lightwell::xr
