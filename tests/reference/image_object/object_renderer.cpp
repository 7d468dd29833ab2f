#include "reference/image_object/object_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lightwell::reference {
namespace {

constexpr double kF0 = 0.04;
/// Irradiance of a light, so that a white matte surface reflects 0.8.
constexpr double kIrradiance = 0.8 * pi;
constexpr double kHighlightShare = 0.05;
/// In front of the surface; the figurine has a radius of about 1.
constexpr double kRayOffset = 2e-4;
constexpr int kAmbientDirections = 64;

V3 turned(const V3& a, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * a.x + s * a.z, a.y, c * a.z - s * a.x};
}

/// Lambert and GGX with height-correlated Smith masking (Walter et al. 2007; Heitz 2014), times n.l.
struct Reflection {
  double diffuse = 0;  ///< To be multiplied by the albedo.
  double specular = 0;
};

Reflection reflection(const V3& n, const V3& l, const V3& v, double alpha) {
  const double nl = dot(n, l), nv = std::max(1e-4, dot(n, v));
  if (nl <= 0) return {};
  const V3 h = normalised(l + v);
  const double nh = dot(n, h), vh = dot(v, h), a2 = alpha * alpha;
  const double fresnel = kF0 + (1 - kF0) * std::pow(1 - vh, 5);
  const double t = nh * nh * (a2 - 1) + 1, distribution = a2 / (pi * t * t);
  const double visibility = 0.5 / (nl * std::sqrt(nv * nv * (1 - a2) + a2) + nv * std::sqrt(nl * nl * (1 - a2) + a2));
  return {(1 - fresnel) * nl / pi, fresnel * distribution * visibility * nl};
}

/// A surface point that a sample of a pixel sees, in the object's frame.
struct Hit {
  V3 at, normal, facet, to_eye;
  FigurineMaterial material;
  double depth = 0;
};

}  // namespace

struct ObjectRenderer::Scene {
  FigurineMesh mesh = make_figurine();
  MeshRays rays{mesh};

  bool hit(const V3& eye, const V3& towards, Hit& out) const {
    const auto first = rays.first_hit(eye, towards);
    if (!first) return false;
    out.at = first->at;
    out.facet = first->facet;
    out.normal = first->normal;
    out.to_eye = -1.0 * towards;
    out.material = figurine_material(mesh.parts[first->triangle], out.at);
    return true;
  }

  [[nodiscard]] bool occluded(const Hit& hit, const V3& towards) const {
    return rays.occluded(hit.at + kRayOffset * hit.facet, towards);
  }

  /// Adds the light that a hit reflects to a pixel; returns whether it is lit.
  bool add(const Hit& hit, const V3& towards, double weight, std::array<double, 3>& rgb, double& specular) const {
    if (dot(hit.facet, towards) <= 0) return false;
    const Reflection r = reflection(hit.normal, towards, hit.to_eye, hit.material.alpha);
    if (r.diffuse <= 0 || occluded(hit, towards)) return false;
    for (std::size_t c = 0; c < 3; ++c) rgb[c] += weight * (r.diffuse * hit.material.albedo[c] + r.specular);
    specular += weight * r.specular;
    return true;
  }
};

V3 arc_direction(double degrees) {
  const double angle = degrees * pi / 180, elevation = 35 * pi / 180;
  return {std::cos(angle), std::sin(angle) * std::sin(elevation), std::sin(angle) * std::cos(elevation)};
}

ObjectRenderer::ObjectRenderer() : scene_(std::make_unique<Scene>()) {}
ObjectRenderer::~ObjectRenderer() = default;

ObjectRenderer::View ObjectRenderer::render(const RigView& view, const std::vector<RigLight>& lights) const {
  const auto pixels = static_cast<std::size_t>(view.side) * static_cast<std::size_t>(view.side);
  const int count = view.samples * view.samples;
  View out;
  out.coverage.assign(pixels, 0);
  out.depth.assign(pixels, 0);
  out.ambient.assign(pixels, {});
  out.pictures.resize(lights.size());
  for (LitPicture& picture : out.pictures) {
    picture.rgb.assign(pixels, {});
    picture.light.assign(pixels, PixelLight::dark);
  }
  std::vector<V3> sky;
  const double golden = pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < kAmbientDirections; ++i) {
    const double y = 1 - (2.0 * i + 1) / kAmbientDirections, ring = std::sqrt(1 - y * y);
    sky.push_back({ring * std::cos(golden * i), y, ring * std::sin(golden * i)});
  }
  // The turntable turns the object by turn_rad; here the camera and the lights turn back.
  const V3 eye = turned({0, 0, kCameraDistance}, -view.turn_rad);
  std::vector<Hit> hits(static_cast<std::size_t>(count));
  std::vector<int> strata(static_cast<std::size_t>(count));
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const int column = static_cast<int>(pixel) % view.side, row = static_cast<int>(pixel) / view.side;
    std::size_t found = 0;
    double depth = 0;
    for (int s = 0; s < count; ++s) {
      const double x = (column + (s % view.samples + 0.5) / view.samples) / view.side;
      const double y = (row + (s / view.samples + 0.5) / view.samples) / view.side;
      const V3 towards = normalised({kHalfWidth * (2 * x - 1), kHalfWidth * (1 - 2 * y), -kCameraDistance});
      Hit& hit = hits[found];
      if (!scene_->hit(eye, turned(towards, -view.turn_rad), hit)) continue;
      strata[found++] = s;
      depth += dot(hit.at - eye, turned({0, 0, -1}, -view.turn_rad));
    }
    if (found == 0) continue;
    out.coverage[pixel] = static_cast<float>(found) / static_cast<float>(count);
    out.depth[pixel] = static_cast<float>(depth / static_cast<double>(found));
    // A rotation of the disc's points for each pixel, the same for all lights.
    const double spin = std::fmod(0.754877666 * column + 0.569840291 * row, 1.0);
    for (std::size_t k = 0; k < lights.size(); ++k) {
      const V3 axis = turned(lights[k].towards, -view.turn_rad);
      const V3 side = normalised(cross(std::abs(axis.y) < 0.9 ? V3{0, 1, 0} : V3{1, 0, 0}, axis));
      const V3 up = cross(axis, side);
      std::array<double, 3> rgb{};
      double specular = 0;
      std::size_t lit = 0;
      for (std::size_t h = 0; h < found; ++h) {
        V3 towards = axis;
        if (lights[k].angular_radius_rad > 0) {
          // Vogel's spiral, in an order in which neighbouring samples of the pixel see distant points of the cap.
          const int point = strata[h] * 29 % count;
          const double r = std::sqrt((point + 0.5) / count) * std::tan(lights[k].angular_radius_rad);
          const double angle = golden * point + 2 * pi * spin;
          towards = normalised(axis + (r * std::cos(angle)) * side + (r * std::sin(angle)) * up);
        }
        if (scene_->add(hits[h], towards, kIrradiance / count, rgb, specular)) ++lit;
      }
      const double sum = rgb[0] + rgb[1] + rgb[2];
      LitPicture& picture = out.pictures[k];
      picture.rgb[pixel] = {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2])};
      picture.light[pixel] = lit == 0                               ? PixelLight::dark
                             : lit < found                          ? PixelLight::edge
                             : 3 * specular > kHighlightShare * sum ? PixelLight::highlight
                                                                    : PixelLight::lit;
    }
    std::array<double, 3> rgb{};
    double specular = 0;
    for (std::size_t h = 0; h < found; ++h)
      for (const V3& towards : sky) scene_->add(hits[h], towards, 4 * pi / (kAmbientDirections * count), rgb, specular);
    out.ambient[pixel] = {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2])};
  }
  return out;
}

}  // namespace lightwell::reference
