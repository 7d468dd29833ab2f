// The uniform block of the lights, and a shadow map for each of them.
#pragma once

#include <functional>
#include <span>

#include <glm/glm.hpp>

#include <lightwell/result.hpp>

#include "ar_viewer/gl_objects.hpp"
#include "ar_viewer/light_state.hpp"
#include "ar_viewer/shader_program.hpp"

namespace lightwell::viewer {

/// A sphere around all that casts shadows; radius 0: nothing does.
struct CasterBounds {
  Vec3d centre;
  double radius_m = 0;
};

class ShadowMaps {
 public:
  /// Texels along a map's edge. Larger: finer edges of hard shadows, more time.
  static constexpr int kEdge = 1024;

  [[nodiscard]] static Result<ShadowMaps> make();

  /// Fills the uniform block and draws the maps. casters: a sphere around each object, at most Scene::kMaxObjects; all:
  /// one around all of them. draw(program) draws the objects; it sets world_object.
  void update(const LightState& light, float exposure, std::span<const CasterBounds> casters, const CasterBounds& all,
              const std::function<void(const ShaderProgram&)>& draw) const;

 private:
  explicit ShadowMaps(ShaderProgram program);

  ShaderProgram program_;
  GlBuffer block_;
  GlTexture maps_;
  GlFramebuffer framebuffer_;
};

}  // namespace lightwell::viewer
