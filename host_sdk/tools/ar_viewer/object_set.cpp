#include "ar_viewer/object_set.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include <lightwell/glm.hpp>

#include "ar_viewer/box.hpp"

namespace lightwell::viewer {
namespace {

void set_material(const ShaderProgram& program, const Material& m, bool has_normal_map) {
  program.set("base_color", glm::vec3(m.base_color[0], m.base_color[1], m.base_color[2]));
  for (const auto& [name, value] :
       {std::pair{"lambert", m.lambert}, std::pair{"blinn_phong", m.blinn_phong}, std::pair{"shininess", m.shininess},
        std::pair{"anisotropic", m.anisotropic}, std::pair{"n_u", m.n_u}, std::pair{"n_v", m.n_v},
        std::pair{"reflection", m.reflection}, std::pair{"refraction", m.refraction}, std::pair{"ior", m.ior},
        std::pair{"fresnel", m.fresnel}, std::pair{"fresnel_power", m.fresnel_power},
        std::pair{"metal_rough", m.metal_rough}, std::pair{"metallic", m.metallic}, std::pair{"roughness", m.roughness},
        std::pair{"normal_scale", has_normal_map ? m.normal_scale : 0.0F}})
    program.set(name, value);
}

void bind(Unit unit, const GlTexture& texture) {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  glBindTexture(GL_TEXTURE_2D, texture.name());
}

/// The picture of a path, or `otherwise`.
Result<BytePicture> picture_of(const std::string& path, BytePicture otherwise) {
  if (path.empty()) return otherwise;
  return read_bytes(path);
}

}  // namespace

Result<ObjectPrograms> ObjectPrograms::make() {
  Result<ShaderProgram> fragment = ShaderProgram::make("object_vertex.glsl", "object_fragment.glsl");
  if (!fragment.ok()) return fragment.status();
  Result<ShaderProgram> vertex =
      ShaderProgram::make("object_vertex.glsl", "object_fragment.glsl", "#define VERTEX_LIGHTING\n");
  if (!vertex.ok()) return vertex.status();
  return ObjectPrograms{std::move(*fragment), std::move(*vertex)};
}

Result<ObjectSet::Placed> ObjectSet::load(const Object& object) {
  Result<Model> model = load_model(object.mesh);
  if (!model.ok()) return model.status();
  scale_to(*model, object.size_m);
  Placed placed;
  placed.anchor = object.anchor;
  placed.T_anchor_object = object.T_anchor_object;
  Box<double> box;
  for (ModelPart& part : model->parts) {
    const auto first = static_cast<std::uint32_t>(placed.positions.size());
    for (const Vertex& v : part.mesh.vertices) {
      placed.positions.push_back(v.position);
      box.add(vec_cast<double>(v.position));
    }
    for (const std::uint32_t index : part.mesh.indices) placed.indices.push_back(first + index);
    const Material material = part.material && !object.material_given ? *part.material : object.material;
    Result<BytePicture> color = picture_of(material.texture, std::move(part.color));
    if (!color.ok()) return color.status();
    Result<BytePicture> normal = picture_of(material.normal_map, std::move(part.normal));
    if (!normal.ok()) return normal.status();
    placed.parts.push_back({GpuMesh(part.mesh), material, make_texture(*color, TextureContent::color),
                            make_texture(*normal, TextureContent::vectors), !normal->empty()});
  }
  if (!placed.positions.empty()) placed.centre = box.center();
  for (const Vec3f& p : placed.positions)
    placed.radius_m = std::max(placed.radius_m, length(vec_cast<double>(p) - placed.centre));
  return placed;
}

Result<ObjectSet> ObjectSet::make(const std::vector<Object>& objects) {
  ObjectSet set;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    Result<Placed> placed = load(objects[i]);
    if (!placed.ok()) return placed.status().in("objects[" + std::to_string(i) + "]");
    set.objects_.push_back(std::move(*placed));
  }
  set.place({});
  return set;
}

void ObjectSet::place(const Pose& T_world_body) {
  positions_.clear();
  indices_.clear();
  Box<double> box;
  for (Placed& object : objects_) {
    object.T_world_object =
        object.anchor == Anchor::world ? object.T_anchor_object : compose(T_world_body, object.T_anchor_object);
    const auto first = static_cast<std::uint32_t>(positions_.size());
    for (const Vec3f& p : object.positions) {
      const Vec3d q = transformed(object.T_world_object, vec_cast<double>(p));
      positions_.push_back(vec_cast<float>(q));
      box.add(q);
    }
    for (const std::uint32_t index : object.indices) indices_.push_back(first + index);
  }
  bounds_ = {};
  if (positions_.empty()) return;
  bounds_.centre = box.center();
  for (const Vec3f& p : positions_)
    bounds_.radius_m = std::max(bounds_.radius_m, length(vec_cast<double>(p) - bounds_.centre));
  // Texels of a map at the very edge belong to the objects.
  bounds_.radius_m *= 1.01;
}

std::vector<Material*> ObjectSet::materials(std::size_t i) {
  std::vector<Material*> materials;
  for (Part& part : objects_[i].parts) materials.push_back(&part.material);
  return materials;
}

bool ObjectSet::reflects(std::size_t i) const {
  return std::any_of(objects_[i].parts.begin(), objects_[i].parts.end(), [](const Part& part) {
    return part.material.reflection > 0 || part.material.refraction > 0 || part.material.metal_rough > 0;
  });
}

CasterBounds ObjectSet::bounds(std::size_t i) const {
  return {transformed(objects_[i].T_world_object, objects_[i].centre), objects_[i].radius_m};
}

void ObjectSet::draw_depth(const ShaderProgram& program) const {
  for (const Placed& object : objects_) {
    program.set("world_object", glm::mat4(to_glm(object.T_world_object)));
    for (const Part& part : object.parts) part.mesh.draw();
  }
}

void ObjectSet::draw(std::size_t i, const ObjectPrograms& programs, const Viewpoint& from, float environment_levels,
                     float objects_edge) const {
  const Placed& object = objects_[i];
  for (const Part& part : object.parts) {
    const ShaderProgram& program =
        part.material.lighting == LightingRate::fragment ? programs.fragment : programs.vertex;
    program.use();
    program.set("clip_world", from.clip_world);
    program.set("eye", from.eye);
    program.set("world_object", glm::mat4(to_glm(object.T_world_object)));
    program.set("world_normal", glm::mat3(to_glm(object.T_world_object)));
    program.set("environment_levels", environment_levels);
    program.set("objects_edge", objects_edge);
    set_material(program, part.material, part.has_normal_map);
    bind(Unit::color, part.color);
    bind(Unit::normal, part.normal);
    part.mesh.draw();
  }
}

}  // namespace lightwell::viewer
