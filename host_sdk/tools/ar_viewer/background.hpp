// The camera picture behind the objects: a still picture, a video or a camera.
#pragma once

#include <memory>
#include <string>

#include <lightwell/result.hpp>

#include "ar_viewer/picture.hpp"
#include "ar_viewer/scene.hpp"

namespace lightwell::viewer {

class Background {
 public:
  /// invalid_argument if a picture does not have the camera's size, the errors of read_bytes() and read_exr(),
  /// not_found for a video or a camera that cannot be opened.
  [[nodiscard]] static Result<Background> open(const Scene& scene);
  Background(Background&&) noexcept;
  Background& operator=(Background&&) noexcept;
  ~Background();

  /// Advances to the next picture; the last one of a video stays. Blocks until a camera has it.
  [[nodiscard]] Status next();

  /// Linear picture values without lens distortion, in the camera's size. changed(): since the call of next() before.
  [[nodiscard]] const Picture& picture() const;
  [[nodiscard]] bool changed() const;
  /// The same in 8 bit grey (sRGB), for the tag tracker; row by row.
  [[nodiscard]] const std::vector<std::uint8_t>& grey() const;

 private:
  struct Impl;
  explicit Background(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightwell::viewer
