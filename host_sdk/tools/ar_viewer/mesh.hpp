// Triangle meshes of virtual objects.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "ar_viewer/material.hpp"
#include "ar_viewer/picture.hpp"

namespace lightwell::viewer {

struct Vertex {
  Vec3f position;
  Vec3f normal;  ///< Unit.
  std::array<float, 2> uv{};
  std::array<float, 4> tangent{1, 0, 0,
                               1};  ///< As glTF: unit, along increasing u; w: the bitangent is w (normal x tangent).
};

/// Three indices for each triangle.
struct Mesh {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
};

/// A part of a model with one material.
struct ModelPart {
  Mesh mesh;
  std::optional<Material> material;  ///< Of a file, as metal-rough; none: the scene's.
  BytePicture color, normal;         ///< Textures of a file; empty: none.
};

struct Model {
  std::vector<ModelPart> parts;
};

/// Largest size of a model: of a file, before memory is allocated for it.
inline constexpr std::size_t kMaxModelVertices = 2'000'000;
inline constexpr std::size_t kMaxModelBytes = std::size_t{256} << 20;

// Meshes with extents of about 1, +Y up; the surface's outside is where triangles turn anticlockwise.
[[nodiscard]] Mesh make_sphere(int rings, int segments);
[[nodiscard]] Mesh make_box();
[[nodiscard]] Mesh make_cylinder(int segments);
/// Newell's teapot (1975): 32 bicubic patches, each of n x n squares.
[[nodiscard]] Mesh make_teapot(int n);
/// A cloth folded twice in an S, with waves along the folds. Without thickness.
[[nodiscard]] Mesh make_cloth(int n);

/// sphere, box, cylinder, teapot or cloth, with the middle of its bottom at the origin, or a .glb or .gltf file.
/// invalid_argument for another name, not_found and data_loss for a file; resource_exhausted for one above
/// kMaxModelBytes or kMaxModelVertices.
[[nodiscard]] Result<Model> load_model(const std::string& mesh);
/// A glTF 2.0 file: triangles of the scene's nodes with their base colour, normal map, metallic and roughness factors.
[[nodiscard]] Result<Model> load_gltf(const std::string& path);

/// Scales to extents, m: none: unchanged; one: the largest; three: each.
void scale_to(Model& model, const std::vector<double>& size_m);

/// Tangents from the texture coordinates, by triangles (Lengyel 2001).
void compute_tangents(Mesh& mesh);
/// Smooth normals by area.
void compute_normals(Mesh& mesh);

}  // namespace lightwell::viewer
