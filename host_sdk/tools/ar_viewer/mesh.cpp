#include "ar_viewer/mesh.hpp"

#include <algorithm>

#include "ar_viewer/box.hpp"

namespace lightwell::viewer {
namespace {

Box<float> box_of(const Model& model) {
  Box<float> box;
  for (const ModelPart& part : model.parts)
    for (const Vertex& v : part.mesh.vertices) box.add(v.position);
  return box;
}

void stand_on_origin(Model& model) {
  const Box<float> box = box_of(model);
  const Vec3f foot{box.center().x, box.low.y, box.center().z};
  for (ModelPart& part : model.parts)
    for (Vertex& v : part.mesh.vertices) v.position = v.position - foot;
}

}  // namespace

Result<Model> load_model(const std::string& mesh) {
  if (mesh.ends_with(".glb") || mesh.ends_with(".gltf")) return load_gltf(mesh);
  Model model;
  model.parts.resize(1);
  Mesh& made = model.parts[0].mesh;
  if (mesh == "sphere")
    made = make_sphere(32, 64);
  else if (mesh == "box")
    made = make_box();
  else if (mesh == "cylinder")
    made = make_cylinder(64);
  else if (mesh == "teapot")
    made = make_teapot(7);
  else if (mesh == "cloth")
    made = make_cloth(20);
  else
    return invalid_argument("mesh '" + mesh +
                            "' is not known; it is sphere, box, cylinder, teapot, cloth, or a .glb or .gltf file");
  stand_on_origin(model);
  return model;
}

void scale_to(Model& model, const std::vector<double>& size_m) {
  if (size_m.empty()) return;
  const Vec3f extent = box_of(model).extent();
  const auto factor = [](double size, float of) { return of > 0 ? static_cast<float>(size) / of : 1.0F; };
  Vec3f scale;
  if (size_m.size() == 1) {
    const float s = factor(size_m[0], std::max({extent.x, extent.y, extent.z}));
    scale = {s, s, s};
  } else {
    scale = {factor(size_m[0], extent.x), factor(size_m[1], extent.y), factor(size_m[2], extent.z)};
  }
  for (ModelPart& part : model.parts)
    for (Vertex& v : part.mesh.vertices) {
      v.position = {v.position.x * scale.x, v.position.y * scale.y, v.position.z * scale.z};
      // A normal is transformed by the inverse transpose.
      v.normal = normalized(Vec3f{v.normal.x / scale.x, v.normal.y / scale.y, v.normal.z / scale.z});
      const Vec3f t = normalized(Vec3f{v.tangent[0] * scale.x, v.tangent[1] * scale.y, v.tangent[2] * scale.z});
      v.tangent = {t.x, t.y, t.z, v.tangent[3]};
    }
}

void compute_tangents(Mesh& mesh) {
  std::vector<Vec3f> u(mesh.vertices.size()), v(mesh.vertices.size());
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const Vertex& a = mesh.vertices[mesh.indices[i]];
    const Vertex& b = mesh.vertices[mesh.indices[i + 1]];
    const Vertex& c = mesh.vertices[mesh.indices[i + 2]];
    const Vec3f p = b.position - a.position, q = c.position - a.position;
    const float pu = b.uv[0] - a.uv[0], pv = b.uv[1] - a.uv[1], qu = c.uv[0] - a.uv[0], qv = c.uv[1] - a.uv[1];
    const float determinant = pu * qv - qu * pv;
    if (determinant == 0) continue;
    const float sign = determinant > 0 ? 1.0F : -1.0F;
    for (std::size_t k = 0; k < 3; ++k) {
      u[mesh.indices[i + k]] += (p * qv - q * pv) * sign;
      v[mesh.indices[i + k]] += (q * pu - p * qu) * sign;
    }
  }
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    Vertex& vertex = mesh.vertices[i];
    Vec3f t = normalized(u[i] - vertex.normal * dot(vertex.normal, u[i]));
    if (length(t) == 0) t = tangent_basis(vertex.normal)[0];
    vertex.tangent = {t.x, t.y, t.z, dot(cross(vertex.normal, t), v[i]) < 0 ? -1.0F : 1.0F};
  }
}

void compute_normals(Mesh& mesh) {
  for (Vertex& v : mesh.vertices) v.normal = {};
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const Vec3f a = mesh.vertices[mesh.indices[i]].position;
    const Vec3f n =
        cross(mesh.vertices[mesh.indices[i + 1]].position - a, mesh.vertices[mesh.indices[i + 2]].position - a);
    for (std::size_t k = 0; k < 3; ++k) mesh.vertices[mesh.indices[i + k]].normal += n;
  }
  for (Vertex& v : mesh.vertices) v.normal = normalized(v.normal);
}

}  // namespace lightwell::viewer
