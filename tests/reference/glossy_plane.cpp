#include "reference/glossy_plane.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lightwell::reference {

namespace {

/// g(c) of gloss_brdf().
double smith_g(double alpha, double cosine) {
  const double a2 = alpha * alpha;
  return std::sqrt(a2 + (1 - a2) * cosine * cosine);
}

/// f_s n.l, which is finite for n.v and n.l down to 0.
double brdf_times_cosine(const Gloss& gloss, const V3& v, const V3& l) {
  if (!(v.z > 0) || !(l.z > 0)) return 0;
  const V3 h = normalised(v + l);
  const double a2 = gloss.alpha * gloss.alpha;
  // (n.h)^2 (a2 - 1) + 1, with 1 - (n.h)^2 from the tangential components, which keep their digits.
  const double q = a2 * h.z * h.z + h.x * h.x + h.y * h.y;
  const double d = a2 / (pi * q * q);
  const double visibility = 0.5 / (l.z * smith_g(gloss.alpha, v.z) + v.z * smith_g(gloss.alpha, l.z));
  return d * visibility * fresnel(gloss, dot(v, h)) * l.z;
}

void add(Rgb& sum, double weight, const Rgb& value) {
  for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * value[c];
}

/// The offset from the pixel's centre of the middle of sample k of `count`.
double sample_offset(int k, int count) { return (k + 0.5) / count - 0.5; }

Rgb texel(const PlaneTexture& t, int i, int j) {
  const std::size_t at = 3 * (static_cast<std::size_t>(std::clamp(j, 0, t.n - 1)) * static_cast<std::size_t>(t.n) +
                              static_cast<std::size_t>(std::clamp(i, 0, t.n - 1)));
  return {t.rgb[at], t.rgb[at + 1], t.rgb[at + 2]};
}

/// dz/dx of the surface.
double slope_at(const GlossyScene& scene, double x) { return 2 * scene.curl * x / scene.size_m; }

/// The point where the ray eye + t d meets the surface; d points downwards.
V3 surface_point(const GlossyScene& scene, const V3& eye, const V3& d) {
  double z = 0;
  V3 at;
  // Each step is contracted by the slope over the tangent of the ray's elevation.
  for (int step = 0; step < (scene.curl == 0 ? 1 : 20); ++step) {
    at = eye + ((z - eye.z) / d.z) * d;
    z = scene.curl * at.x * at.x / scene.size_m;
  }
  return at;
}

/// S towards v at a point of the surface.
Rgb specular_at(const GlossyScene& scene, double x, const V3& v) {
  const SpecularTable* table = scene.right_half && x >= 0 ? *scene.right_half : scene.specular;
  if (table == nullptr) return {};
  if (scene.curl == 0) return table->radiance(v);
  const V3 n = normalised({-slope_at(scene, x), 0, 1});
  const V3 mirrored = 2 * dot(n, v) * n - v;
  return table->radiance({-mirrored.x, -mirrored.y, mirrored.z});
}

Rgb irradiance_at(const GlossyScene& scene, double x) {
  Rgb out = scene.irradiance;
  if (scene.curl != 0) add(out, slope_at(scene, x), scene.irradiance_by_slope);
  return out;
}

/// The rays of a camera in the plane's frame.
class Rays {
 public:
  Rays(const PinholeCamera& camera, const Pose& T_camera_plane)
      : camera_(camera), plane_from_camera_(transposed(T_camera_plane.rotation)), eye_(eye_of(T_camera_plane)) {}

  [[nodiscard]] const V3& eye() const { return eye_; }
  /// Of any length.
  [[nodiscard]] V3 direction(double x, double y) const {
    return rotated(plane_from_camera_, {(x - camera_.cx) / camera_.focal_px, (y - camera_.cy) / camera_.focal_px, 1});
  }

 private:
  PinholeCamera camera_;
  M3 plane_from_camera_;
  V3 eye_;
};

}  // namespace

double fresnel(const Gloss& gloss, double v_dot_h) {
  const double c = v_dot_h;
  switch (gloss.fresnel) {
    case FresnelTerm::kOne:
      return 1;
    case FresnelTerm::kDielectric: {
      const double g = std::sqrt(gloss.index * gloss.index - 1 + c * c);
      const double s = (g - c) / (g + c);
      const double p = (c * (g + c) - 1) / (c * (g - c) + 1);
      return 0.5 * s * s * (1 + p * p);
    }
    case FresnelTerm::kSchlick:
      break;
  }
  const double m = std::clamp(1 - c, 0.0, 1.0);
  return gloss.f0 + (1 - gloss.f0) * m * m * m * m * m;
}

double gloss_brdf(const Gloss& gloss, const V3& v_plane, const V3& l_plane) {
  return l_plane.z > 0 ? brdf_times_cosine(gloss, v_plane, l_plane) / l_plane.z : 0;
}

Rgb specular_radiance(const Panorama& env, const V3& v_plane, const Gloss& gloss, int samples_per_axis) {
  Rgb sum{};
  if (!(v_plane.z > 0)) return sum;
  const int s = samples_per_axis;
  for (int j = 0; j < env.height && 2 * j < env.height; ++j) {
    for (int i = 0; i < env.width; ++i) {
      double weight = 0;
      for (int b = 0; b < s; ++b) {
        const double cell = pixel_solid_angle(j * s + b, env.width, env.height * s) / s;
        for (int a = 0; a < s; ++a) {
          const V3 l = plane_from_world(
              pixel_direction(i + sample_offset(a, s), j + sample_offset(b, s), env.width, env.height));
          weight += cell * brdf_times_cosine(gloss, v_plane, l);
        }
      }
      add(sum, weight, pixel(env, i, j));
    }
  }
  return sum;
}

Rgb plane_irradiance(const Panorama& env) {
  Rgb sum{};
  for (int j = 0; j < env.height; ++j) {
    const double top = std::max(0.0, std::sin(pi * (0.5 - static_cast<double>(j) / env.height)));
    const double bottom = std::max(0.0, std::sin(pi * (0.5 - (j + 1.0) / env.height)));
    const double weight = 2 * pi / env.width * 0.5 * (top * top - bottom * bottom);
    for (int i = 0; i < env.width; ++i) add(sum, weight, pixel(env, i, j));
  }
  return sum;
}

Rgb albedo_at(const PlaneTexture& texture, double size_m, double x, double y) {
  const double column = (x / size_m + 0.5) * texture.n - 0.5;
  const double row = (0.5 - y / size_m) * texture.n - 0.5;
  if (texture.nearest) {
    return texel(texture, static_cast<int>(std::floor(column + 0.5)), static_cast<int>(std::floor(row + 0.5)));
  }
  const double left = std::floor(column), upper = std::floor(row);
  const double s = column - left, t = row - upper;
  const int i = static_cast<int>(left), j = static_cast<int>(upper);
  Rgb value{};
  add(value, (1 - s) * (1 - t), texel(texture, i, j));
  add(value, s * (1 - t), texel(texture, i + 1, j));
  add(value, (1 - s) * t, texel(texture, i, j + 1));
  add(value, s * t, texel(texture, i + 1, j + 1));
  return value;
}

V3 eye_of(const Pose& T_camera_plane) {
  return -1.0 * rotated(transposed(T_camera_plane.rotation), T_camera_plane.translation);
}

Rgb radiance_towards(const GlossyScene& scene, double x, double y, const V3& v_plane) {
  const Rgb albedo = albedo_at(scene.albedo, scene.size_m, x, y);
  const Rgb irradiance = irradiance_at(scene, x);
  Rgb value = specular_at(scene, x, v_plane);
  for (std::size_t c = 0; c < 3; ++c) value[c] += albedo[c] / pi * irradiance[c];
  return value;
}

GlossyView render_view(const GlossyScene& scene, const PinholeCamera& camera, const Pose& T_camera_plane,
                       int samples_per_axis, int specular_samples_per_axis) {
  const Rays rays(camera, T_camera_plane);
  const V3& eye = rays.eye();
  const double half = scene.size_m / 2;
  const std::size_t count = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  GlossyView view{camera.width, camera.height, std::vector<double>(3 * count), std::vector<double>(count)};
  const double share = 1.0 / (samples_per_axis * samples_per_axis);
  const double specular_share = 1.0 / (specular_samples_per_axis * specular_samples_per_axis);
  for (std::size_t at = 0; at < count; ++at) {
    const double x = static_cast<double>(at % static_cast<std::size_t>(camera.width));
    const double y = static_cast<double>(at / static_cast<std::size_t>(camera.width));
    Rgb diffuse{};  // the sum of albedo times irradiance over the samples on the plane
    int on_plane = 0;
    for (int b = 0; b < samples_per_axis && eye.z > 0; ++b) {
      for (int a = 0; a < samples_per_axis; ++a) {
        const V3 d = rays.direction(x + sample_offset(a, samples_per_axis), y + sample_offset(b, samples_per_axis));
        if (!(d.z < 0)) continue;
        const V3 p = surface_point(scene, eye, d);
        if (std::abs(p.x) > half || std::abs(p.y) > half) continue;
        const Rgb albedo = albedo_at(scene.albedo, scene.size_m, p.x, p.y), irradiance = irradiance_at(scene, p.x);
        for (std::size_t c = 0; c < 3; ++c) diffuse[c] += albedo[c] * irradiance[c];
        ++on_plane;
      }
    }
    const double coverage = on_plane * share;
    Rgb value{};
    for (std::size_t c = 0; c < 3; ++c) {
      value[c] = share * diffuse[c] / pi + (1 - coverage) * scene.background[c];
    }
    for (int k = 0; k < specular_samples_per_axis * specular_samples_per_axis; ++k) {
      if (on_plane == 0) break;
      const int a = k % specular_samples_per_axis, b = k / specular_samples_per_axis;
      const V3 d = rays.direction(x + sample_offset(a, specular_samples_per_axis),
                                  y + sample_offset(b, specular_samples_per_axis));
      add(value, coverage * specular_share, specular_at(scene, surface_point(scene, eye, d).x, -1.0 * normalised(d)));
    }
    view.coverage[at] = coverage;
    std::copy(value.begin(), value.end(), view.rgb.begin() + static_cast<std::ptrdiff_t>(3 * at));
  }
  return view;
}

}  // namespace lightwell::reference
