// The light around the probe as a cube map: six square faces of radiance, for engines that sample cube textures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <lightwell/lighting.hpp>

namespace lightwell {

/// Layout of a texel in memory, of this machine's byte order.
enum class CubeFormat : std::uint8_t {
  rgba16f,  ///< Four half floats, alpha 1: GL_RGBA16F, rgba16float. The largest value is 65504.
  rgba32f,  ///< Four floats, alpha 1: GL_RGBA32F, rgba32float.
  rgb9e5,   ///< Shared exponent, 32 bits: GL_RGB9_E5, rgb9e5ufloat. The largest value is 65408.
};

inline constexpr int kMaxCubeEdge = 64;

struct CubeMapOptions {
  int edge = kMaxCubeEdge;  ///< Texels along an edge of a face, 1 to kMaxCubeEdge. The time hardly depends on it.
  CubeFormat format = CubeFormat::rgba16f;
  /// yes: the discrete lights are caps of uniform radiance. no: for a renderer that shades them by itself.
  LightsIncluded lights = LightsIncluded::yes;
  /// Texel value = scale * radiance, for lights beyond the largest value of the format (the sun: 1e9 cd/m²). Above 0.
  float scale = 1;
};

/// 0 for an edge that is not 1 to kMaxCubeEdge.
[[nodiscard]] constexpr std::size_t cube_map_bytes(int edge, CubeFormat format) {
  if (edge < 1 || edge > kMaxCubeEdge) return 0;
  const std::size_t texel = format == CubeFormat::rgba32f ? 16 : format == CubeFormat::rgba16f ? 8 : 4;
  return 6 * texel * static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge);
}

/// Unit vector of a place on a face, u to the right and v down in [0, 1], by the table of OpenGL (OpenGL 4.6, table
/// 8.19), Vulkan and WebGPU: faces in the order +X, -X, +Y, -Y, +Z, -Z, row 0 at v = 0. `face` is 0 to 5.
[[nodiscard]] Vec3f cube_direction(int face, float u, float v);

/// Fills `texels`, of cube_map_bytes() bytes: the faces in the order of cube_direction(), rows from v = 0, without
/// padding. A texel is the mean of the radiance over its solid angle, so that no light is lost or counted twice where
/// faces meet; sample it with seamless filtering. Axes are those of `light`: of the probe, or of the frame of rotated()
/// and in_world(). Radiance is radiance(d, 0), from the environment map or else from the harmonics, and the lights.
/// A light keeps its energy however small it is: the texels that it covers sum up to it.
///
/// value: the number of texels with a channel above the largest value of the format, which they have instead. Validity,
/// age, bound and flags as radiance(). invalid_query for an edge, a format or a scale that is not allowed, and for
/// `texels` of another size; nothing is written then. Without light all texels are 0. Milliseconds, see
/// host_sdk/README.md; does not allocate, any thread.
[[nodiscard]] Answer<std::size_t> cube_map(const Lighting& light, const CubeMapOptions& options,
                                           std::span<std::byte> texels);

}  // namespace lightwell
