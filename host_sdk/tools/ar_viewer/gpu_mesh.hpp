// Meshes and textures in OpenGL.
#pragma once

#include <vector>

#include "ar_viewer/gl_objects.hpp"
#include "ar_viewer/mesh.hpp"

namespace lightwell::viewer {

/// Attributes of object_vertex.glsl.
class GpuMesh {
 public:
  explicit GpuMesh(const Mesh& mesh);
  void draw() const;

 private:
  GlVertexArray array_;
  GlBuffer vertices_, indices_;
  GLsizei count_ = 0;
};

/// Colours of a picture: GL_SRGB8, which OpenGL makes linear; others: GL_RGB8.
enum class TextureContent { color, vectors };
/// With mipmaps, repeating. One texel, white or a flat normal, for an empty picture.
[[nodiscard]] GlTexture make_texture(const BytePicture& picture, TextureContent content);

}  // namespace lightwell::viewer
