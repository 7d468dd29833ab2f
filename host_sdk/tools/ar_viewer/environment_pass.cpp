#include "ar_viewer/environment_pass.hpp"

#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include <glm/glm.hpp>

#include <lightwell/cube_map.hpp>
#include <lightwell/glm.hpp>

namespace lightwell::viewer {
namespace {

/// Texels in a row of the texture. Each level has a multiple of them.
constexpr GLsizei kRow = 64;

/// Maps x, y (-1 to 1 along columns and rows of a face) and 1 to a direction.
glm::mat3 axes_of_face(int face) {
  const glm::vec3 center = to_glm(cube_direction(face, 0.5F, 0.5F));
  const auto axis = [&](float u, float v) {
    const glm::vec3 border = to_glm(cube_direction(face, u, v));
    return border / glm::dot(border, center) - center;
  };
  return {axis(1, 0.5F), axis(0.5F, 1), center};
}

}  // namespace

EnvironmentPass::EnvironmentPass(ShaderProgram program) : program_(std::move(program)) {
  glBindTexture(GL_TEXTURE_2D, texels_.name());
  set_sampling(GL_TEXTURE_2D, GL_NEAREST, GL_NEAREST, GL_CLAMP_TO_EDGE);
}

Result<EnvironmentPass> EnvironmentPass::make() {
  Result<ShaderProgram> program = ShaderProgram::make("screen_vertex.glsl", "octahedral_fragment.glsl");
  if (!program.ok()) return program.status();
  return EnvironmentPass(std::move(*program));
}

void EnvironmentPass::upload(const EnvironmentView& map, const EnvironmentScale& scale) {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::map_texels));
  glBindTexture(GL_TEXTURE_2D, texels_.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB9_E5, kRow, static_cast<GLsizei>(map.map.texels.size()) / kRow, 0, GL_RGB,
               GL_UNSIGNED_INT_5_9_9_9_REV, map.map.texels.data());
  if (&map.mirror != &map.map)
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, kRow, static_cast<GLsizei>(map.mirror.texels.size()) / kRow, GL_RGB,
                    GL_UNSIGNED_INT_5_9_9_9_REV, map.mirror.texels.data());
  program_.use();
  program_.set("map_world", glm::mat3_cast(to_glm(map.rotation.inverse())));
  // In double: 2^-150 is below the range of float.
  program_.set("factor", static_cast<float>(std::ldexp(static_cast<double>(scale.factor), map.map.exponent)));
  program_.set("constant", glm::vec3(scale.constant.r, scale.constant.g, scale.constant.b));
}

void EnvironmentPass::draw(const EnvironmentMap& map, GLuint cube, int level, int edge, float roughness) const {
  const std::span levels(map.levels);
  const EnvironmentLevelPair pair = levels_around(levels, roughness);
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::map_texels));
  glBindTexture(GL_TEXTURE_2D, texels_.name());
  program_.use();
  program_.set("edges", glm::ivec2(levels[pair.lower].edge, levels[pair.upper].edge));
  program_.set("first_texels",
               glm::ivec2(texel_count(levels.first(pair.lower)), texel_count(levels.first(pair.upper))));
  program_.set("upper_share", pair.upper_share);
  program_.set("face_edge", edge);
  for (const GLenum state : {GL_DEPTH_TEST, GL_BLEND, GL_SCISSOR_TEST}) glDisable(state);
  glBindVertexArray(screen_.name());
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glViewport(0, 0, edge, edge);
  for (int face = 0; face < 6; ++face) {
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0,
                           GL_TEXTURE_CUBE_MAP_POSITIVE_X + static_cast<GLenum>(face), cube, level);
    program_.set("world_face", axes_of_face(face));
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
}

}  // namespace lightwell::viewer
