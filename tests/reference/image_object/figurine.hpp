// The object of the image-based object's reference data: a mesh with wrinkled and concave parts, texture and gloss.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "reference/image_object/mesh_rays.hpp"
#include "reference/vector.hpp"

namespace lightwell::reference {

/// Parts of the figurine; each is a surface with its own texture and gloss.
enum class FigurinePart : std::uint8_t {
  body,   ///< A wrinkled ellipsoid, striped.
  bowl,   ///< A hollow half sphere with a pattern.
  ball,   ///< In the bowl: it casts shadows into it.
  ring,   ///< A torus.
  plate,  ///< A rippled disc on which the others stand.
};

/// Lambert's diffuse reflection below a dielectric GGX surface of that alpha, with Fresnel reflectance 0.04.
struct FigurineMaterial {
  std::array<double, 3> albedo{};  ///< Linear Rec. 709.
  double alpha = 0.5;
};

/// Triangles with a normal at each vertex, inside the sphere of radius 1.25 around the origin, +Y up. The vertices at
/// the bottom of the bowl, its pole, have no normal: there the neighbours' count.
struct FigurineMesh : SmoothMesh {
  std::vector<FigurinePart> parts;  ///< Of each triangle.
};

/// The same on every machine up to rounding: closed forms alone.
[[nodiscard]] FigurineMesh make_figurine();

/// The material of a part at a point of its surface.
[[nodiscard]] FigurineMaterial figurine_material(FigurinePart part, const V3& at);

}  // namespace lightwell::reference
