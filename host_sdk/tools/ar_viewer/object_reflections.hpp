// The objects as each of them sees the others: a cube map around each reflecting object.
#pragma once

#include <optional>
#include <vector>

#include "ar_viewer/gl_objects.hpp"
#include "ar_viewer/object_set.hpp"

namespace lightwell::viewer {

/// Premultiplied radiance of the other objects from the middle of this one; A is their coverage, the room shows where
/// it is 0. Parallax within the object is left out. Objects in these maps reflect the room alone.
class ObjectReflections {
 public:
  /// edge: texels along a face's edge; 0: no maps.
  explicit ObjectReflections(int edge) : edge_(edge) {}

  /// Draws the maps of all objects that reflect, if there is another one.
  void update(const ObjectSet& objects, const ObjectPrograms& programs, float environment_levels);
  /// Binds the map of object i to Unit::objects; the uniform objects_edge: 0 without a map.
  [[nodiscard]] float bind(std::size_t i) const;

 private:
  struct Map {
    GlTexture cube;
  };
  void draw_map(std::size_t i, const ObjectSet& objects, const ObjectPrograms& programs, float environment_levels);

  int edge_;
  std::optional<GlFramebuffer> framebuffer_;
  std::optional<GlRenderbuffer> depth_;
  std::vector<std::optional<Map>> maps_;
};

}  // namespace lightwell::viewer
