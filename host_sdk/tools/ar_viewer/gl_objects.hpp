// OpenGL objects that delete themselves. A context of OpenGL 3.3 core must be current wherever they are used.
#pragma once

#include <utility>

#include <epoxy/gl.h>

namespace lightwell::viewer {

/// One OpenGL name; moves, does not copy. 0 after a move.
template <class Kind>
class GlObject {
 public:
  GlObject() : name_(Kind::make()) {}
  GlObject(GlObject&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  ~GlObject() {
    if (name_ != 0) Kind::release(name_);
  }

  [[nodiscard]] GLuint name() const { return name_; }

 private:
  GLuint name_;
};

namespace gl_kind {
struct Texture {
  static GLuint make() {
    GLuint name = 0;
    glGenTextures(1, &name);
    return name;
  }
  static void release(GLuint name) { glDeleteTextures(1, &name); }
};
struct Buffer {
  static GLuint make() {
    GLuint name = 0;
    glGenBuffers(1, &name);
    return name;
  }
  static void release(GLuint name) { glDeleteBuffers(1, &name); }
};
struct VertexArray {
  static GLuint make() {
    GLuint name = 0;
    glGenVertexArrays(1, &name);
    return name;
  }
  static void release(GLuint name) { glDeleteVertexArrays(1, &name); }
};
struct Framebuffer {
  static GLuint make() {
    GLuint name = 0;
    glGenFramebuffers(1, &name);
    return name;
  }
  static void release(GLuint name) { glDeleteFramebuffers(1, &name); }
};
struct Renderbuffer {
  static GLuint make() {
    GLuint name = 0;
    glGenRenderbuffers(1, &name);
    return name;
  }
  static void release(GLuint name) { glDeleteRenderbuffers(1, &name); }
};
}  // namespace gl_kind

using GlTexture = GlObject<gl_kind::Texture>;
using GlBuffer = GlObject<gl_kind::Buffer>;
using GlVertexArray = GlObject<gl_kind::VertexArray>;
using GlFramebuffer = GlObject<gl_kind::Framebuffer>;
using GlRenderbuffer = GlObject<gl_kind::Renderbuffer>;

/// Sampling of the texture that is bound to `target`.
inline void set_sampling(GLenum target, GLenum minification, GLenum magnification, GLenum wrap) {
  glTexParameteri(target, GL_TEXTURE_MIN_FILTER, static_cast<GLint>(minification));
  glTexParameteri(target, GL_TEXTURE_MAG_FILTER, static_cast<GLint>(magnification));
  for (const GLenum side : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
    glTexParameteri(target, side, static_cast<GLint>(wrap));
}

}  // namespace lightwell::viewer
