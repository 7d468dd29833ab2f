// Draws the descriptor's environment map into levels of a cube map.
#pragma once

#include <lightwell/lighting.hpp>
#include <lightwell/result.hpp>

#include "ar_viewer/gl_objects.hpp"
#include "ar_viewer/shader_program.hpp"

namespace lightwell::viewer {

/// Picture values of a map's radiance L: L * factor + constant.
struct EnvironmentScale {
  float factor = 1;
  Radiance constant;
};

/// radiance(d, r) of the SDK (environment_radiance()) in a fragment shader, from the texels as they are in the map.
class EnvironmentPass {
 public:
  /// internal for a shader that does not compile.
  [[nodiscard]] static Result<EnvironmentPass> make();

  /// Makes the map the one that draw() reads, its first level with the lights that it shows (EnvironmentView::mirror).
  void upload(const EnvironmentView& map, const EnvironmentScale& scale);
  /// Fills level `level`, edge x edge texels a face, of `cube`, which must have it in a format that can be drawn to.
  /// Axes of the cube: the world's. Changes the framebuffer, the viewport, and what is enabled.
  void draw(const EnvironmentMap& map, GLuint cube, int level, int edge, float roughness) const;

 private:
  explicit EnvironmentPass(ShaderProgram program);

  ShaderProgram program_;
  GlTexture texels_;
  GlFramebuffer framebuffer_;
  GlVertexArray screen_;
};

}  // namespace lightwell::viewer
