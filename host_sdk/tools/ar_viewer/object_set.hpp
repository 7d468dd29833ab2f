// The virtual objects of a scene: meshes, materials, and where they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include <lightwell/result.hpp>

#include "ar_viewer/gpu_mesh.hpp"
#include "ar_viewer/scene.hpp"
#include "ar_viewer/shader_program.hpp"
#include "ar_viewer/shadow_maps.hpp"

namespace lightwell::viewer {

/// From where a picture is drawn.
struct Viewpoint {
  glm::mat4 clip_world{1};
  glm::vec3 eye{0};
};

/// The programs of object_vertex.glsl and object_fragment.glsl, by LightingRate.
struct ObjectPrograms {
  ShaderProgram fragment, vertex;

  [[nodiscard]] static Result<ObjectPrograms> make();
};

class ObjectSet {
 public:
  /// The errors of load_model() and read_bytes(), with the object's number.
  [[nodiscard]] static Result<ObjectSet> make(const std::vector<Object>& objects);

  /// T_world_body: where objects on Anchor::marker_body are.
  void place(const Pose& T_world_body);

  [[nodiscard]] std::size_t size() const { return objects_.size(); }
  /// Materials of object i, which may be changed; one for each part of its model.
  [[nodiscard]] std::vector<Material*> materials(std::size_t i);
  [[nodiscard]] bool reflects(std::size_t i) const;

  // As placed, in the world, m.
  [[nodiscard]] const CasterBounds& bounds() const { return bounds_; }
  [[nodiscard]] CasterBounds bounds(std::size_t i) const;
  /// All triangles.
  [[nodiscard]] std::vector<Vec3f>& positions() { return positions_; }
  [[nodiscard]] const std::vector<std::uint32_t>& indices() const { return indices_; }

  /// All, for a program that has the uniform world_object.
  void draw_depth(const ShaderProgram& program) const;
  /// One with its materials. objects_edge: uniform of reflectance.glsl.
  void draw(std::size_t i, const ObjectPrograms& programs, const Viewpoint& from, float environment_levels,
            float objects_edge) const;

 private:
  struct Part {
    GpuMesh mesh;
    Material material;
    GlTexture color, normal;
    bool has_normal_map = false;
  };
  struct Placed {
    Anchor anchor = Anchor::world;
    Pose T_anchor_object;
    Pose T_world_object;
    std::vector<Part> parts;
    std::vector<Vec3f> positions;  ///< In the object's frame.
    std::vector<std::uint32_t> indices;
    Vec3d centre;  ///< Of the bounding box, in the object's frame.
    double radius_m = 0;
  };
  [[nodiscard]] static Result<Placed> load(const Object& object);

  std::vector<Placed> objects_;
  CasterBounds bounds_;
  std::vector<Vec3f> positions_;
  std::vector<std::uint32_t> indices_;
};

}  // namespace lightwell::viewer
