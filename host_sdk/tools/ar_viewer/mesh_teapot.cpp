// The Utah teapot: M. Newell, "The Utilization of Procedure Models in Digital Image Synthesis", 1975. Ten of its 32
// patches; the others are their mirror images.
#include <array>
#include <cstddef>

#include "ar_viewer/mesh.hpp"

namespace lightwell::viewer {
namespace {

using Patch = std::array<std::uint8_t, 16>;

constexpr std::array<Patch, 10> kPatches = {{
    {102, 103, 104, 105, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15},                // rim
    {12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27},              // body
    {24, 25, 26, 27, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39, 40},              //
    {96, 96, 96, 96, 97, 98, 99, 100, 101, 101, 101, 101, 0, 1, 2, 3},             // lid
    {0, 1, 2, 3, 106, 107, 108, 109, 110, 111, 112, 113, 114, 115, 116, 117},      //
    {118, 118, 118, 118, 124, 122, 119, 121, 123, 126, 125, 120, 40, 39, 38, 37},  // bottom
    {41, 42, 43, 44, 45, 46, 47, 48, 49, 50, 51, 52, 53, 54, 55, 56},              // handle
    {53, 54, 55, 56, 57, 58, 59, 60, 61, 62, 63, 64, 28, 65, 66, 67},              //
    {68, 69, 70, 71, 72, 73, 74, 75, 76, 77, 78, 79, 80, 81, 82, 83},              // spout
    {80, 81, 82, 83, 84, 85, 86, 87, 88, 89, 90, 91, 92, 93, 94, 95},              //
}};
/// The first six are a quarter of a surface of revolution, the others a half of handle and spout.
constexpr std::size_t kQuarters = 6;

/// x, y, z with z up.
constexpr std::array<std::array<float, 3>, 127> kPoints = {{
    {0.2F, 0, 2.7F},
    {0.2F, -0.112F, 2.7F},
    {0.112F, -0.2F, 2.7F},
    {0, -0.2F, 2.7F},
    {1.3375F, 0, 2.53125F},
    {1.3375F, -0.749F, 2.53125F},
    {0.749F, -1.3375F, 2.53125F},
    {0, -1.3375F, 2.53125F},
    {1.4375F, 0, 2.53125F},
    {1.4375F, -0.805F, 2.53125F},
    {0.805F, -1.4375F, 2.53125F},
    {0, -1.4375F, 2.53125F},
    {1.5F, 0, 2.4F},
    {1.5F, -0.84F, 2.4F},
    {0.84F, -1.5F, 2.4F},
    {0, -1.5F, 2.4F},
    {1.75F, 0, 1.875F},
    {1.75F, -0.98F, 1.875F},
    {0.98F, -1.75F, 1.875F},
    {0, -1.75F, 1.875F},
    {2, 0, 1.35F},
    {2, -1.12F, 1.35F},
    {1.12F, -2, 1.35F},
    {0, -2, 1.35F},
    {2, 0, 0.9F},
    {2, -1.12F, 0.9F},
    {1.12F, -2, 0.9F},
    {0, -2, 0.9F},
    {-2, 0, 0.9F},
    {2, 0, 0.45F},
    {2, -1.12F, 0.45F},
    {1.12F, -2, 0.45F},
    {0, -2, 0.45F},
    {1.5F, 0, 0.225F},
    {1.5F, -0.84F, 0.225F},
    {0.84F, -1.5F, 0.225F},
    {0, -1.5F, 0.225F},
    {1.5F, 0, 0.15F},
    {1.5F, -0.84F, 0.15F},
    {0.84F, -1.5F, 0.15F},
    {0, -1.5F, 0.15F},
    {-1.6F, 0, 2.025F},
    {-1.6F, -0.3F, 2.025F},
    {-1.5F, -0.3F, 2.25F},
    {-1.5F, 0, 2.25F},
    {-2.3F, 0, 2.025F},
    {-2.3F, -0.3F, 2.025F},
    {-2.5F, -0.3F, 2.25F},
    {-2.5F, 0, 2.25F},
    {-2.7F, 0, 2.025F},
    {-2.7F, -0.3F, 2.025F},
    {-3, -0.3F, 2.25F},
    {-3, 0, 2.25F},
    {-2.7F, 0, 1.8F},
    {-2.7F, -0.3F, 1.8F},
    {-3, -0.3F, 1.8F},
    {-3, 0, 1.8F},
    {-2.7F, 0, 1.575F},
    {-2.7F, -0.3F, 1.575F},
    {-3, -0.3F, 1.35F},
    {-3, 0, 1.35F},
    {-2.5F, 0, 1.125F},
    {-2.5F, -0.3F, 1.125F},
    {-2.65F, -0.3F, 0.9375F},
    {-2.65F, 0, 0.9375F},
    {-2, -0.3F, 0.9F},
    {-1.9F, -0.3F, 0.6F},
    {-1.9F, 0, 0.6F},
    {1.7F, 0, 1.425F},
    {1.7F, -0.66F, 1.425F},
    {1.7F, -0.66F, 0.6F},
    {1.7F, 0, 0.6F},
    {2.6F, 0, 1.425F},
    {2.6F, -0.66F, 1.425F},
    {3.1F, -0.66F, 0.825F},
    {3.1F, 0, 0.825F},
    {2.3F, 0, 2.1F},
    {2.3F, -0.25F, 2.1F},
    {2.4F, -0.25F, 2.025F},
    {2.4F, 0, 2.025F},
    {2.7F, 0, 2.4F},
    {2.7F, -0.25F, 2.4F},
    {3.3F, -0.25F, 2.4F},
    {3.3F, 0, 2.4F},
    {2.8F, 0, 2.475F},
    {2.8F, -0.25F, 2.475F},
    {3.525F, -0.25F, 2.49375F},
    {3.525F, 0, 2.49375F},
    {2.9F, 0, 2.475F},
    {2.9F, -0.15F, 2.475F},
    {3.45F, -0.15F, 2.5125F},
    {3.45F, 0, 2.5125F},
    {2.8F, 0, 2.4F},
    {2.8F, -0.15F, 2.4F},
    {3.2F, -0.15F, 2.4F},
    {3.2F, 0, 2.4F},
    {0, 0, 3.15F},
    {0.8F, 0, 3.15F},
    {0.8F, -0.45F, 3.15F},
    {0.45F, -0.8F, 3.15F},
    {0, -0.8F, 3.15F},
    {0, 0, 2.85F},
    {1.4F, 0, 2.4F},
    {1.4F, -0.784F, 2.4F},
    {0.784F, -1.4F, 2.4F},
    {0, -1.4F, 2.4F},
    {0.4F, 0, 2.55F},
    {0.4F, -0.224F, 2.55F},
    {0.224F, -0.4F, 2.55F},
    {0, -0.4F, 2.55F},
    {1.3F, 0, 2.55F},
    {1.3F, -0.728F, 2.55F},
    {0.728F, -1.3F, 2.55F},
    {0, -1.3F, 2.55F},
    {1.3F, 0, 2.4F},
    {1.3F, -0.728F, 2.4F},
    {0.728F, -1.3F, 2.4F},
    {0, -1.3F, 2.4F},
    {0, 0, 0},
    {1.425F, -0.798F, 0},
    {1.5F, 0, 0.075F},
    {1.425F, 0, 0},
    {0.798F, -1.425F, 0},
    {0, -1.5F, 0.075F},
    {0, -1.425F, 0},
    {1.5F, -0.84F, 0.075F},
    {0.84F, -1.5F, 0.075F},
}};

/// Cubic Bernstein polynomials and their derivatives at t.
struct Bernstein {
  std::array<float, 4> value, slope;
  explicit Bernstein(float t) {
    const float r = 1 - t;
    value = {r * r * r, 3 * t * r * r, 3 * t * t * r, t * t * t};
    slope = {-3 * r * r, 3 * r * r - 6 * t * r, 6 * t * r - 3 * t * t, 3 * t * t};
  }
};

/// The point with y up, mirrored at the two planes where the sign is -1.
Vec3f control_point(std::uint8_t index, float sign_x, float sign_y) {
  const auto& p = kPoints[index];
  return {sign_x * p[0], p[2], -sign_y * p[1]};
}

void add_patch(Mesh& mesh, const Patch& patch, int n, float sign_x, float sign_y) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto side = static_cast<std::uint32_t>(n);
  const auto vertex = [&](float s, float t) {
    const Bernstein u(s), v(t);
    Vec3f p, along_u, along_v;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t k = 0; k < 4; ++k) {
        const Vec3f c = control_point(patch[4 * i + k], sign_x, sign_y);
        p += c * (v.value[i] * u.value[k]);
        along_u += c * (v.value[i] * u.slope[k]);
        along_v += c * (v.slope[i] * u.value[k]);
      }
    return Vertex{p, normalized(cross(along_u, along_v) * (sign_x * sign_y)), {s, t}};
  };
  for (int i = 0; i <= n; ++i)
    for (int k = 0; k <= n; ++k) {
      const float s = static_cast<float>(k) / static_cast<float>(n), t = static_cast<float>(i) / static_cast<float>(n);
      Vertex made = vertex(s, t);
      // Where an edge of the patch is one point, its derivative vanishes: the limit is that a little inside.
      if (length(made.normal) < 0.5F) made.normal = vertex(s, t < 0.5F ? t + 1e-3F : t - 1e-3F).normal;
      mesh.vertices.push_back(made);
    }
  for (std::uint32_t i = 0; i < side; ++i)
    for (std::uint32_t k = 0; k < side; ++k) {
      const std::uint32_t a = first + i * (side + 1) + k, b = a + 1, c = a + side + 1, d = c + 1;
      if (sign_x * sign_y < 0)
        mesh.indices.insert(mesh.indices.end(), {a, c, d, a, d, b});
      else
        mesh.indices.insert(mesh.indices.end(), {a, d, c, a, b, d});
    }
}

}  // namespace

Mesh make_teapot(int n) {
  Mesh mesh;
  for (std::size_t i = 0; i < kPatches.size(); ++i) {
    add_patch(mesh, kPatches[i], n, 1, 1);
    add_patch(mesh, kPatches[i], n, 1, -1);
    if (i >= kQuarters) continue;
    add_patch(mesh, kPatches[i], n, -1, 1);
    add_patch(mesh, kPatches[i], n, -1, -1);
  }
  for (Vertex& v : mesh.vertices) v.position = v.position * 0.3F;
  compute_tangents(mesh);
  return mesh;
}

}  // namespace lightwell::viewer
