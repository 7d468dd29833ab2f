// glTF 2.0 by tinygltf, which checks the JSON; the ranges of buffers are checked here.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <optional>
#include <tiny_gltf.h>

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "ar_viewer/mesh.hpp"

namespace lightwell::viewer {
namespace {

/// Nodes deeper than this, which a cycle would have, are an error.
constexpr int kMaxDepth = 64;

/// Elements of an accessor, checked to lie in its buffer.
struct Elements {
  const unsigned char* first = nullptr;
  std::size_t count = 0, stride = 0;
  int component_type = 0;

  [[nodiscard]] float number(std::size_t element, std::size_t component) const {
    float value = 0;
    std::memcpy(&value, first + element * stride + component * sizeof value, sizeof value);
    return value;
  }
  [[nodiscard]] std::uint32_t index(std::size_t element) const {
    const unsigned char* at = first + element * stride;
    std::uint32_t value = 0;
    std::memcpy(
        &value, at,
        static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(component_type))));
    return value;  // Little-endian, as the file and every machine that this runs on.
  }
};

template <class T>
const T* element_of(const std::vector<T>& list, int index) {
  return index >= 0 && static_cast<std::size_t>(index) < list.size() ? &list[static_cast<std::size_t>(index)] : nullptr;
}

std::optional<Elements> elements_of(const tinygltf::Model& file, int accessor_index, int type,
                                    std::initializer_list<int> component_types) {
  const tinygltf::Accessor* accessor = element_of(file.accessors, accessor_index);
  if (accessor == nullptr || accessor->type != type || accessor->sparse.isSparse) return std::nullopt;
  if (std::find(component_types.begin(), component_types.end(), accessor->componentType) == component_types.end())
    return std::nullopt;
  const tinygltf::BufferView* view = element_of(file.bufferViews, accessor->bufferView);
  const tinygltf::Buffer* buffer = view == nullptr ? nullptr : element_of(file.buffers, view->buffer);
  if (buffer == nullptr) return std::nullopt;
  const int stride = accessor->ByteStride(*view);
  const auto size =
      static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor->componentType)) *
                               tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type)));
  if (stride <= 0 || accessor->count == 0 || accessor->count > kMaxModelVertices * 8) return std::nullopt;
  const std::size_t begin = view->byteOffset + accessor->byteOffset;
  const std::size_t need = (accessor->count - 1) * static_cast<std::size_t>(stride) + size;
  if (begin > buffer->data.size() || need > buffer->data.size() - begin) return std::nullopt;
  return Elements{buffer->data.data() + begin, accessor->count, static_cast<std::size_t>(stride),
                  accessor->componentType};
}

BytePicture picture_of(const tinygltf::Model& file, int texture_index) {
  const tinygltf::Texture* texture = element_of(file.textures, texture_index);
  const tinygltf::Image* image = texture == nullptr ? nullptr : element_of(file.images, texture->source);
  if (image == nullptr || image->bits != 8 || image->component < 3 || image->width < 1 || image->height < 1) return {};
  const auto pixels = static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height);
  const auto components = static_cast<std::size_t>(image->component);
  if (image->image.size() < pixels * components) return {};
  BytePicture picture{image->width, image->height, std::vector<std::uint8_t>(3 * pixels)};
  for (std::size_t i = 0; i < pixels; ++i)
    std::copy_n(image->image.begin() + static_cast<std::ptrdiff_t>(i * components), 3,
                picture.rgb.begin() + static_cast<std::ptrdiff_t>(3 * i));
  return picture;
}

void add_material(const tinygltf::Model& file, int index, ModelPart& part) {
  const tinygltf::Material* from = element_of(file.materials, index);
  Material material;
  material.lambert = 0;
  material.metal_rough = 1;
  material.base_color = {1, 1, 1};
  if (from != nullptr) {
    const tinygltf::PbrMetallicRoughness& pbr = from->pbrMetallicRoughness;
    for (std::size_t c = 0; c < 3 && c < pbr.baseColorFactor.size(); ++c)
      material.base_color[c] = std::clamp(static_cast<float>(pbr.baseColorFactor[c]), 0.0F, 1.0F);
    material.metallic = std::clamp(static_cast<float>(pbr.metallicFactor), 0.0F, 1.0F);
    material.roughness = std::clamp(static_cast<float>(pbr.roughnessFactor), 0.0F, 1.0F);
    part.color = picture_of(file, pbr.baseColorTexture.index);
    part.normal = picture_of(file, from->normalTexture.index);
    material.normal_scale = std::clamp(static_cast<float>(from->normalTexture.scale), 0.0F, 10.0F);
  } else {
    material.roughness = 1;
  }
  part.material = material;
}

class Reader {
 public:
  Reader(const tinygltf::Model& file, const std::string& path) : file_(file), path_(path) {}

  Status read_node(int index, const glm::mat4& parent, int depth) {
    const tinygltf::Node* node = element_of(file_.nodes, index);
    if (node == nullptr || depth > kMaxDepth) return damaged("a node is missing, or nodes form a cycle");
    const glm::mat4 world = parent * transform_of(*node);
    if (const tinygltf::Mesh* mesh = element_of(file_.meshes, node->mesh))
      for (const tinygltf::Primitive& primitive : mesh->primitives)
        if (Status status = read_primitive(primitive, world); !status.ok()) return status;
    for (const int child : node->children)
      if (Status status = read_node(child, world, depth + 1); !status.ok()) return status;
    return {};
  }

  Model model;

 private:
  [[nodiscard]] Status damaged(const std::string& what) const { return {StatusCode::data_loss, path_ + ": " + what}; }

  static glm::mat4 transform_of(const tinygltf::Node& node) {
    if (node.matrix.size() == 16) return glm::mat4(glm::make_mat4(node.matrix.data()));
    glm::mat4 m(1);
    if (node.translation.size() == 3)
      m[3] = glm::vec4(node.translation[0], node.translation[1], node.translation[2], 1);
    if (node.rotation.size() == 4)
      m = m * glm::mat4_cast(glm::quat(static_cast<float>(node.rotation[3]), static_cast<float>(node.rotation[0]),
                                       static_cast<float>(node.rotation[1]), static_cast<float>(node.rotation[2])));
    if (node.scale.size() == 3)
      for (int c = 0; c < 3; ++c) m[c] *= static_cast<float>(node.scale[static_cast<std::size_t>(c)]);
    return m;
  }

  std::optional<Elements> attribute(const tinygltf::Primitive& primitive, const char* name, int type) const {
    const auto found = primitive.attributes.find(name);
    if (found == primitive.attributes.end()) return std::nullopt;
    return elements_of(file_, found->second, type, {TINYGLTF_COMPONENT_TYPE_FLOAT});
  }

  Status read_primitive(const tinygltf::Primitive& primitive, const glm::mat4& world) {
    if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != -1) return {};
    const auto positions = attribute(primitive, "POSITION", TINYGLTF_TYPE_VEC3);
    if (!positions) return damaged("a primitive has no readable POSITION (float, not sparse, within its buffer)");
    vertices_ += positions->count;
    if (vertices_ > kMaxModelVertices)
      return {StatusCode::resource_exhausted, path_ + ": more than " + std::to_string(kMaxModelVertices) + " vertices"};
    const auto normals = attribute(primitive, "NORMAL", TINYGLTF_TYPE_VEC3);
    const auto uvs = attribute(primitive, "TEXCOORD_0", TINYGLTF_TYPE_VEC2);
    ModelPart part;
    const glm::mat3 linear(world);
    const glm::mat3 normal_matrix =
        std::abs(glm::determinant(linear)) > 0 ? glm::transpose(glm::inverse(linear)) : glm::mat3(1);
    part.mesh.vertices.resize(positions->count);
    for (std::size_t i = 0; i < positions->count; ++i) {
      Vertex& v = part.mesh.vertices[i];
      const glm::vec4 p =
          world * glm::vec4(positions->number(i, 0), positions->number(i, 1), positions->number(i, 2), 1);
      v.position = {p.x, p.y, p.z};
      if (!is_finite(v.position)) return damaged("a vertex is NaN or infinite");
      if (normals && i < normals->count) {
        const glm::vec3 n =
            normal_matrix * glm::vec3(normals->number(i, 0), normals->number(i, 1), normals->number(i, 2));
        v.normal = normalized(Vec3f{n.x, n.y, n.z});
      }
      if (uvs && i < uvs->count) v.uv = {uvs->number(i, 0), uvs->number(i, 1)};
    }
    if (Status status = read_indices(primitive, part.mesh); !status.ok()) return status;
    if (!normals || normals->count < positions->count) compute_normals(part.mesh);
    compute_tangents(part.mesh);
    add_material(file_, primitive.material, part);
    model.parts.push_back(std::move(part));
    return {};
  }

  Status read_indices(const tinygltf::Primitive& primitive, Mesh& mesh) const {
    if (primitive.indices < 0) {
      for (std::uint32_t i = 0; i < mesh.vertices.size() / 3 * 3; ++i) mesh.indices.push_back(i);
      return {};
    }
    const auto indices = elements_of(file_, primitive.indices, TINYGLTF_TYPE_SCALAR,
                                     {TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT,
                                      TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT});
    if (!indices)
      return damaged("the indices of a primitive are not readable (unsigned, not sparse, within their buffer)");
    mesh.indices.resize(indices->count / 3 * 3);
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
      mesh.indices[i] = indices->index(i);
      if (mesh.indices[i] >= mesh.vertices.size()) return damaged("an index is beyond the vertices");
    }
    return {};
  }

  const tinygltf::Model& file_;
  const std::string& path_;
  std::size_t vertices_ = 0;
};

}  // namespace

Result<Model> load_gltf(const std::string& path) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  if (error) return Status(StatusCode::not_found, path + ": " + error.message());
  if (bytes > kMaxModelBytes)
    return Status(StatusCode::resource_exhausted,
                  path + ": larger than " + std::to_string(kMaxModelBytes >> 20) + " MiB; reduce the model");
  tinygltf::TinyGLTF loader;
  tinygltf::Model file;
  std::string why, warning;
  const bool read = path.ends_with(".glb") ? loader.LoadBinaryFromFile(&file, &why, &warning, path)
                                           : loader.LoadASCIIFromFile(&file, &why, &warning, path);
  if (!read) return Status(StatusCode::data_loss, path + ": not a glTF 2.0 file: " + why);
  const tinygltf::Scene* scene = element_of(file.scenes, std::max(file.defaultScene, 0));
  if (scene == nullptr) return Status(StatusCode::data_loss, path + ": the file has no scene");
  Reader reader(file, path);
  for (const int node : scene->nodes)
    if (Status status = reader.read_node(node, glm::mat4(1), 0); !status.ok()) return status;
  if (reader.model.parts.empty())
    return Status(StatusCode::data_loss, path + ": the scene of the file has no triangles");
  return std::move(reader.model);
}

}  // namespace lightwell::viewer
