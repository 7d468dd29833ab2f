#include "ar_viewer/gpu_mesh.hpp"

#include <cstddef>
#include <cstdint>

namespace lightwell::viewer {
namespace {

void attribute(GLuint location, GLint components, std::size_t offset) {
  glEnableVertexAttribArray(location);
  glVertexAttribPointer(location, components, GL_FLOAT, GL_FALSE, sizeof(Vertex),
                        reinterpret_cast<const void*>(offset));  // NOLINT: an offset
}

}  // namespace

GpuMesh::GpuMesh(const Mesh& mesh) : count_(static_cast<GLsizei>(mesh.indices.size())) {
  glBindVertexArray(array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, vertices_.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.vertices.size() * sizeof(Vertex)), mesh.vertices.data(),
               GL_STATIC_DRAW);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.name());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.indices.size() * sizeof(std::uint32_t)),
               mesh.indices.data(), GL_STATIC_DRAW);
  attribute(0, 3, offsetof(Vertex, position));
  attribute(1, 3, offsetof(Vertex, normal));
  attribute(2, 2, offsetof(Vertex, uv));
  attribute(3, 4, offsetof(Vertex, tangent));
}

void GpuMesh::draw() const {
  glBindVertexArray(array_.name());
  glDrawElements(GL_TRIANGLES, count_, GL_UNSIGNED_INT, nullptr);
}

GlTexture make_texture(const BytePicture& picture, TextureContent content) {
  GlTexture texture;
  glBindTexture(GL_TEXTURE_2D, texture.name());
  const auto format = static_cast<GLint>(content == TextureContent::color ? GL_SRGB8 : GL_RGB8);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  if (picture.empty()) {
    const std::uint8_t texel[3] = {content == TextureContent::color ? std::uint8_t{255} : std::uint8_t{128},
                                   content == TextureContent::color ? std::uint8_t{255} : std::uint8_t{128}, 255};
    glTexImage2D(GL_TEXTURE_2D, 0, format, 1, 1, 0, GL_RGB, GL_UNSIGNED_BYTE, texel);
  } else {
    glTexImage2D(GL_TEXTURE_2D, 0, format, picture.width, picture.height, 0, GL_RGB, GL_UNSIGNED_BYTE,
                 picture.rgb.data());
  }
  glGenerateMipmap(GL_TEXTURE_2D);
  set_sampling(GL_TEXTURE_2D, GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR, GL_REPEAT);
  return texture;
}

}  // namespace lightwell::viewer
