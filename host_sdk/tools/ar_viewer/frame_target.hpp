// The picture that is drawn into: linear float, four samples a pixel.
#pragma once

#include "ar_viewer/gl_objects.hpp"
#include "ar_viewer/picture.hpp"

namespace lightwell::viewer {

class FrameTarget {
 public:
  FrameTarget(int width, int height);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  /// Draws go here from now on, into the whole picture.
  void bind() const;
  /// Averages the samples into texture().
  void resolve() const;
  /// Of the last resolve(); row 0 is the bottom.
  [[nodiscard]] GLuint texture() const { return resolved_texture_.name(); }
  /// Waits until all is drawn, and copies the resolved picture.
  void read(Picture& out) const;

 private:
  int width_, height_;
  GlRenderbuffer color_, depth_;
  GlFramebuffer samples_, resolved_;
  GlTexture resolved_texture_;
};

}  // namespace lightwell::viewer
