// An OpenGL context without a display.
#pragma once

#include <memory>
#include <string>

#include <lightwell/result.hpp>

namespace lightwell::viewer {

/// OpenGL 3.3 core through EGL, on the surfaceless platform or on a device, current in the thread that made it until it
/// is destroyed.
class HeadlessContext {
 public:
  /// failed_precondition, with the packages to install, if there is no such context.
  [[nodiscard]] static Result<HeadlessContext> make();
  HeadlessContext(HeadlessContext&&) noexcept;
  HeadlessContext& operator=(HeadlessContext&&) noexcept;
  ~HeadlessContext();

  /// GL_RENDERER, such as "llvmpipe (LLVM 15.0.6, 256 bits)".
  [[nodiscard]] std::string renderer() const;

 private:
  struct Egl;
  explicit HeadlessContext(std::unique_ptr<Egl> egl);
  std::unique_ptr<Egl> egl_;
};

}  // namespace lightwell::viewer
