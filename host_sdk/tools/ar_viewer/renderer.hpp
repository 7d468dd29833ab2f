// Draws a frame: background, shadow on the real plane, objects.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <lightwell/result.hpp>

#include "ar_viewer/frame_target.hpp"
#include "ar_viewer/light_state.hpp"
#include "ar_viewer/object_reflections.hpp"
#include "ar_viewer/object_set.hpp"
#include "ar_viewer/reflection_maps.hpp"
#include "ar_viewer/residual_shadow.hpp"
#include "ar_viewer/scene.hpp"
#include "ar_viewer/shader_program.hpp"
#include "ar_viewer/shadow_maps.hpp"
#include "ar_viewer/split_sum.hpp"

namespace lightwell::viewer {

/// Columns of the picture, from the left.
struct Columns {
  int first = 0, count = 0;
};

/// The part of the picture that draw() fills. Each keeps the maps of its own light.
enum class Half : std::uint8_t { left, right };

/// Time of a part of the drawing, ms.
struct DrawTimes {
  double light_ms = 0;   ///< Queries of the SDK that fill the maps of the light.
  double shadow_ms = 0;  ///< The SDK's ShadowCaster.
};

/// Needs a current context, the same until it is destroyed.
class Renderer {
 public:
  /// `scene` must outlive it. Its members exposure and shadow may change between frames, camera, objects and ground
  /// must not. Errors of ObjectSet::make(); internal for a shader that does not compile.
  [[nodiscard]] static Result<Renderer> make(const Scene& scene);

  void set_background(const Picture& picture);
  /// Another source of reflections.
  void set_reflection(const ReflectionStyle& style);
  [[nodiscard]] ObjectSet& objects() { return objects_; }

  /// The background alone.
  void draw_background();
  /// All in these columns. Light with Shading::off: the background alone.
  [[nodiscard]] Result<DrawTimes> draw(const LightState& light, const Pose& T_world_camera, Columns columns,
                                       Half half = Half::left);
  /// The factor of the real plane instead of the picture, 1 beside it, without objects in front.
  [[nodiscard]] Status draw_shadow(const LightState& light, const Pose& T_world_camera);

  /// Finishes the picture. target().texture() is valid then.
  void finish() { target_.resolve(); }
  [[nodiscard]] const FrameTarget& target() const { return target_; }

 private:
  struct Programs {
    ObjectPrograms objects;
    ShaderProgram ground, background;
  };
  /// Made from a light, and kept while it stays.
  struct LightMaps {
    ResidualShadow residual_shadow;
    ReflectionMaps reflection_maps;
  };
  Renderer(const Scene& scene, Programs programs, ObjectSet objects, ShadowMaps shadow_maps,
           std::array<LightMaps, 2> light_maps);

  [[nodiscard]] Viewpoint viewpoint(const Pose& T_world_camera) const;
  /// Maps of the light and of its shadows.
  [[nodiscard]] Result<DrawTimes> prepare(const LightState& light, LightMaps& maps);
  void draw_ground(const Viewpoint& from);

  const Scene* scene_;
  Programs programs_;
  ObjectSet objects_;
  std::vector<CasterBounds> casters_;
  ShadowMaps shadow_maps_;
  std::array<LightMaps, 2> light_maps_;  ///< By Half.
  ResidualShadow::Square residual_square_;
  ObjectReflections object_reflections_;
  FrameTarget target_;
  GlTexture background_, split_sum_;
  GlVertexArray screen_, ground_;
  GlBuffer ground_corners_;
};

}  // namespace lightwell::viewer
