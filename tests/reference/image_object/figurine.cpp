#include "reference/image_object/figurine.hpp"

#include <cmath>
#include <functional>

namespace lightwell::reference {
namespace {

constexpr V3 kBody{-0.3, 0.02, -0.08}, kBowl{0.5, -0.28, 0.25}, kRing{0.28, 0.42, -0.3};

/// A point of a parametric surface; both parameters are in 0..1.
using Surface = std::function<V3(double u, double v)>;

/// Adds a grid of (columns + 1) x (rows + 1) vertices of a surface. The normal is that of central differences.
void add_surface(FigurineMesh& mesh, FigurinePart part, int columns, int rows, const Surface& surface) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  constexpr double kStep = 1e-5;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i) {
      const double u = static_cast<double>(i) / columns, v = static_cast<double>(j) / rows;
      // The poles of a sphere have no tangent along u.
      const double inner = std::fmin(std::fmax(v, 1e-3), 1 - 1e-3);
      mesh.positions.push_back(surface(u, v));
      mesh.normals.push_back(normalised(cross(surface(u, inner + kStep) - surface(u, inner - kStep),
                                              surface(u + kStep, inner) - surface(u - kStep, inner))));
    }
  const auto at = [&](int i, int j) { return first + static_cast<std::uint32_t>(j * (columns + 1) + i); };
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
      mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      mesh.parts.insert(mesh.parts.end(), 2, part);
    }
}

/// Unit vector; v = 0 is down, 1 is up.
V3 sphere(double u, double v) {
  const double azimuth = 2 * pi * u, polar = pi * v;
  return {std::sin(polar) * std::cos(azimuth), -std::cos(polar), std::sin(polar) * std::sin(azimuth)};
}

V3 body(double u, double v) {
  const V3 d = sphere(u, v);
  const double wrinkles = 0.035 * std::sin(26 * d.y + 3 * std::sin(5 * d.x + 2 * d.z)) +
                          0.06 * std::sin(6 * d.x + 4 * d.y) * std::cos(5 * d.z - 3 * d.y) +
                          0.02 * std::sin(31 * d.x + 17 * d.z + 9 * d.y);
  const double r = 1 + wrinkles;
  return kBody + V3{0.5 * r * d.x, 0.72 * r * d.y, 0.46 * r * d.z};
}

/// The wall of the bowl: from the rim along the outside to the bottom and along the inside back, tilted to the front.
V3 bowl(double u, double v) {
  const bool outside = v < 0.5;
  const double polar = pi * (outside ? v : 1 - v), r = outside ? 0.42 : 0.385, azimuth = 2 * pi * u;
  // v = 0: the rim. polar is 0 there and pi / 2 at the bottom.
  const V3 p{r * std::cos(polar) * std::cos(azimuth), -r * std::sin(polar), -r * std::cos(polar) * std::sin(azimuth)};
  const double tilt = 0.5, c = std::cos(tilt), s = std::sin(tilt);
  return kBowl + V3{p.x, c * p.y - s * p.z, s * p.y + c * p.z};
}

V3 ball(double u, double v) { return kBowl + V3{-0.06, -0.1, 0.06} + 0.2 * sphere(u, v); }

V3 ring(double u, double v) {
  const double a = 2 * pi * u, b = 2 * pi * v, r = 0.3 + 0.095 * std::cos(b);
  const V3 p{r * std::cos(a), r * std::sin(a), 0.095 * std::sin(b)};
  const double turn = 0.6, c = std::cos(turn), s = std::sin(turn);
  return kRing + V3{c * p.x + s * p.z, p.y, c * p.z - s * p.x};
}

V3 plate(double u, double v) {
  const double r = 0.02 + 0.98 * v, azimuth = 2 * pi * u;
  return {r * std::cos(azimuth), -0.74 + 0.025 * std::cos(24 * r) + 0.02 * r * std::sin(7 * azimuth),
          -r * std::sin(azimuth)};
}

/// A smooth step of a periodic value, 0 to 1.
double stripes(double phase, double sharpness) { return 0.5 + 0.5 * std::tanh(sharpness * std::sin(phase)); }

/// Fine irregular texture, -1 to 1.
double grain(const V3& p) {
  return std::sin(61 * p.x + 7 * std::sin(23 * p.y)) * std::sin(57 * p.y + 5 * std::sin(29 * p.z)) *
         std::sin(53 * p.z + 6 * std::sin(19 * p.x));
}

FigurineMaterial mixed(const V3& dark, const V3& light, double share, double texture, double alpha) {
  const double k = 1 + texture;
  return {{k * (dark.x + share * (light.x - dark.x)), k * (dark.y + share * (light.y - dark.y)),
           k * (dark.z + share * (light.z - dark.z))},
          alpha};
}

}  // namespace

FigurineMesh make_figurine() {
  FigurineMesh mesh;
  add_surface(mesh, FigurinePart::body, 480, 320, body);
  add_surface(mesh, FigurinePart::bowl, 160, 160, bowl);
  add_surface(mesh, FigurinePart::ball, 96, 64, ball);
  add_surface(mesh, FigurinePart::ring, 160, 64, ring);
  add_surface(mesh, FigurinePart::plate, 320, 160, plate);
  return mesh;
}

FigurineMaterial figurine_material(FigurinePart part, const V3& at) {
  const double texture = 0.18 * grain(at);
  switch (part) {
    case FigurinePart::body:
      return mixed({0.34, 0.17, 0.09}, {0.78, 0.52, 0.3}, stripes(17 * at.y + 2 * std::sin(6 * at.x), 3), texture, 0.4);
    case FigurinePart::bowl:
      return mixed({0.08, 0.14, 0.5}, {0.8, 0.8, 0.76},
                   stripes(24 * (at.x - kBowl.x), 4) * stripes(24 * (at.y - kBowl.y), 4), 0.3 * texture, 0.25);
    case FigurinePart::ball:
      return mixed({0.6, 0.06, 0.05}, {0.6, 0.06, 0.05}, 0, 0.5 * texture, 0.18);
    case FigurinePart::ring:
      return mixed({0.07, 0.42, 0.12}, {0.6, 0.6, 0.1}, stripes(30 * at.x + 22 * at.y, 2), 0.3 * texture, 0.2);
    case FigurinePart::plate:
      break;
  }
  return mixed({0.25, 0.25, 0.27}, {0.62, 0.6, 0.55}, stripes(11 * at.x, 6) * stripes(11 * at.z, 6), texture, 0.5);
}

}  // namespace lightwell::reference
