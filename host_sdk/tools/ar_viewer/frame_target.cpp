#include "ar_viewer/frame_target.hpp"

#include <algorithm>
#include <vector>

namespace lightwell::viewer {
namespace {

constexpr GLsizei kSamples = 4;

}  // namespace

FrameTarget::FrameTarget(int width, int height) : width_(width), height_(height) {
  glBindRenderbuffer(GL_RENDERBUFFER, color_.name());
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, kSamples, GL_RGBA32F, width, height);
  glBindRenderbuffer(GL_RENDERBUFFER, depth_.name());
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, kSamples, GL_DEPTH_COMPONENT32F, width, height);
  glBindFramebuffer(GL_FRAMEBUFFER, samples_.name());
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color_.name());
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_.name());
  glBindTexture(GL_TEXTURE_2D, resolved_texture_.name());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, width, height, 0, GL_RGBA, GL_FLOAT, nullptr);
  set_sampling(GL_TEXTURE_2D, GL_LINEAR, GL_LINEAR, GL_CLAMP_TO_EDGE);
  glBindFramebuffer(GL_FRAMEBUFFER, resolved_.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, resolved_texture_.name(), 0);
}

void FrameTarget::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, samples_.name());
  glViewport(0, 0, width_, height_);
}

void FrameTarget::resolve() const {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, samples_.name());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, resolved_.name());
  glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

void FrameTarget::read(Picture& out) const {
  out.resize(width_, height_);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved_.name());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_, height_, GL_RGBA, GL_FLOAT, out.rgba.data());
  for (int row = 0; row < height_ / 2; ++row)
    std::swap_ranges(out.at(0, row), out.at(0, row) + 4 * static_cast<std::size_t>(width_),
                     out.at(0, height_ - 1 - row));
}

}  // namespace lightwell::viewer
