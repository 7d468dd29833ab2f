#include "report/picture.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include <lightwell/cap.hpp>
#include <lightwell/equirect.hpp>
#include <lightwell/lobes.hpp>
#include <lightwell/text.hpp>

#include "calibration/model/camera_model.hpp"
#include "report/page.hpp"

namespace lightwell::hil {
namespace {

/// Light as a list of directional samples, from a descriptor or from the true panorama.
struct LightSample {
  Vec3f direction;  ///< Unit, towards the light.
  Radiance flux;    ///< Radiance times solid angle: irradiance normal to `direction`.
};

constexpr double kGolden = 2.399963229728653;  // pi (3 - sqrt 5)

Radiance scaled(Irradiance e, float s) { return {e.r * s, e.g * s, e.b * s}; }

/// Adds directions of equal solid angle within the cap of a light (Fibonacci lattice).
void add_cap(const Light& light, std::vector<LightSample>& out) {
  constexpr int kCount = 64;
  const auto [u, v] = tangent_basis(vec_cast<double>(light.direction));
  const double span = 1 - std::cos(light.angular_radius_rad);
  double sum = 0;
  const std::size_t first = out.size();
  for (int i = 0; i < kCount; ++i) {
    const double c = 1 - span * (i + 0.5) / kCount, s = std::sqrt(std::max(0.0, 1 - c * c)), a = kGolden * i;
    const Vec3d d = vec_cast<double>(light.direction) * c + u * (s * std::cos(a)) + v * (s * std::sin(a));
    out.push_back({vec_cast<float>(d), {}});
    sum += c;
  }
  // The vector irradiance weights each direction by its cosine with the axis.
  for (std::size_t i = first; i < out.size(); ++i) out[i].flux = scaled(light.irradiance, static_cast<float>(1 / sum));
}

/// Samples of a descriptor: 64 directions in the cap of each light, and radiance(d, 0), which does not contain the
/// lights and is never negative, on an equirectangular grid.
std::vector<LightSample> samples_of(const Lighting& lighting) {
  std::vector<LightSample> out;
  for (const Light& light : lighting.lights()) add_cap(light, out);
  constexpr int kWidth = 48, kHeight = 24;
  for (int j = 0; j < kHeight; ++j) {
    const auto sr = static_cast<float>(equirect_solid_angle(j, kWidth, kHeight));
    for (int i = 0; i < kWidth; ++i) {
      const Vec3f d = vec_cast<float>(equirect_direction((i + 0.5) / kWidth, (j + 0.5) / kHeight));
      out.push_back({d, lighting.radiance(d, 0).value * sr});
    }
  }
  return out;
}

/// Samples of the panorama in the probe's frame, one per block of 4x4 pixels: rotated by the inverse of R_world_probe.
std::vector<LightSample> samples_of(const sim::Panorama& panorama, Quat rotation_world_probe) {
  std::vector<LightSample> out;
  constexpr int kJoin = 4;
  for (int j = 0; j + kJoin <= panorama.height; j += kJoin) {
    for (int i = 0; i + kJoin <= panorama.width; i += kJoin) {
      Vec3d toward;
      Radiance flux;
      for (int y = j; y < j + kJoin; ++y) {
        const auto sr = static_cast<float>(equirect_solid_angle(y, panorama.width, panorama.height));
        for (int x = i; x < i + kJoin; ++x) {
          const Radiance l = panorama.pixel(x, y) * sr;
          flux += l;
          toward += equirect_direction((x + 0.5) / panorama.width, (y + 0.5) / panorama.height) *
                    (static_cast<double>(l.luminance()) + 1e-12);
        }
      }
      out.push_back({vec_cast<float>(rotate(rotation_world_probe.inverse(), normalized(toward))), flux});
    }
  }
  return out;
}

/// About `count` samples with nearly the same light, chosen deterministically by systematic sampling of the luminance.
/// The flux of skipped samples is added to the next chosen one, so neighbours in the list must be neighbours on the
/// sphere.
std::vector<LightSample> thinned(const std::vector<LightSample>& samples, std::size_t count) {
  double total = 0;
  for (const LightSample& s : samples) total += std::abs(s.flux.luminance());
  std::vector<LightSample> out;
  if (!(total > 0)) return out;
  const double step = total / static_cast<double>(count);
  double at = 0, next = step / 2;
  Radiance skipped;
  for (const LightSample& s : samples) {
    const double l = std::abs(s.flux.luminance());
    skipped += s.flux;
    at += l;
    if (at < next) continue;
    out.push_back({s.direction, skipped});
    skipped = {};
    while (next <= at) next += step;
  }
  return out;
}

struct Hit {
  float distance;
  Vec3f point, normal;
  Albedo albedo;
};

constexpr Vec3f kBall{-0.45F, 0.4F, 0.1F};
constexpr float kBallRadius = 0.4F;
constexpr Vec3f kBlockLow{0.35F, 0, -0.35F}, kBlockHigh{0.8F, 0.9F, 0.1F};
constexpr float kFar = 1e9F;

float hit_ball(Vec3f o, Vec3f d) {
  const Vec3f m = o - kBall;
  const float b = dot(m, d), c = dot(m, m) - kBallRadius * kBallRadius, h = b * b - c;
  if (h < 0) return kFar;
  const float t = -b - std::sqrt(h);
  return t > 1e-3F ? t : kFar;
}

struct BlockHit {
  float t = kFar;
  Vec3f normal;
};

BlockHit hit_block(Vec3f o, Vec3f d) {
  float near = -kFar, far = kFar;
  Vec3f normal;
  const float os[3] = {o.x, o.y, o.z}, ds[3] = {d.x, d.y, d.z};
  const float lo[3] = {kBlockLow.x, kBlockLow.y, kBlockLow.z}, hi[3] = {kBlockHigh.x, kBlockHigh.y, kBlockHigh.z};
  for (int k = 0; k < 3; ++k) {
    const float inv = 1 / (std::abs(ds[k]) > 1e-12F ? ds[k] : 1e-12F);
    float a = (lo[k] - os[k]) * inv, b = (hi[k] - os[k]) * inv;
    if (a > b) std::swap(a, b);
    if (a > near) {
      near = a;
      normal = {};
      (k == 0 ? normal.x : k == 1 ? normal.y : normal.z) = ds[k] > 0 ? -1.0F : 1.0F;
    }
    far = std::min(far, b);
  }
  if (near > far || near < 1e-3F) return {};
  return {near, normal};
}

std::optional<Hit> trace(Vec3f o, Vec3f d) {
  std::optional<Hit> best;
  if (d.y < 0) {
    const float t = -o.y / d.y;
    best = Hit{t, o + d * t, {0, 1, 0}, {0.5F, 0.5F, 0.5F}};
  }
  if (const float t = hit_ball(o, d); t < (best ? best->distance : kFar)) {
    const Vec3f p = o + d * t;
    best = Hit{t, p, normalized(p - kBall), {0.7F, 0.7F, 0.7F}};
  }
  if (const BlockHit b = hit_block(o, d); b.t < (best ? best->distance : kFar))
    best = Hit{b.t, o + d * b.t, b.normal, {0.65F, 0.45F, 0.3F}};
  return best;
}

bool occluded(Vec3f p, Vec3f d) { return hit_ball(p, d) < kFar || hit_block(p, d).t < kFar || d.y < 0; }

/// A ball of `edge` pixels in orthographic view from +Z; `shade` gets the normal and the mirrored view direction.
LinearPicture ball(int edge, const std::function<Radiance(Vec3f, Vec3f)>& shade) {
  LinearPicture out(edge, edge);
  constexpr int kFine = 2;
  for (int j = 0; j < edge; ++j) {
    for (int i = 0; i < edge; ++i) {
      Radiance sum;
      int inside = 0;
      for (int s = 0; s < kFine * kFine; ++s) {
        const float x =
            2 * (static_cast<float>(i) + (static_cast<float>(s % kFine) + 0.5F) / kFine) / static_cast<float>(edge) - 1;
        const float y =
            1 - 2 * (static_cast<float>(j) + (static_cast<float>(s / kFine) + 0.5F) / kFine) / static_cast<float>(edge);
        if (x * x + y * y >= 1) continue;
        const Vec3f n{x, y, std::sqrt(1 - x * x - y * y)};
        const Vec3f view{0, 0, 1};
        sum += shade(n, n * (2 * dot(n, view)) - view);
        ++inside;
      }
      const std::size_t at = static_cast<std::size_t>(j) * static_cast<std::size_t>(edge) + static_cast<std::size_t>(i);
      if (inside > 0) out.pixels[at] = sum * (1.0F / static_cast<float>(inside));
      out.alpha[at] = static_cast<float>(inside) / (kFine * kFine);
    }
  }
  return out;
}

/// Irradiance of the visible light samples on a surface with this normal.
template <class Visible>
Irradiance diffuse(const std::vector<LightSample>& light, Vec3f normal, Visible visible) {
  Irradiance e;
  for (const LightSample& s : light)
    if (const float c = dot(s.direction, normal); c > 0 && visible(s.direction))
      e += Irradiance{s.flux.r * c, s.flux.g * c, s.flux.b * c};
  return e;
}

/// A ball and a block on a matte floor, seen from the front and above, with direct light and shadows.
LinearPicture still_life(int width, int height, const std::vector<LightSample>& light) {
  LinearPicture out(width, height);
  const Vec3f eye{0.2F, 1.7F, 3.0F};
  const Vec3f forward = normalized(Vec3f{0.1F, 0.25F, 0} - eye);
  const Vec3f right = normalized(cross(forward, Vec3f{0, 1, 0})), up = cross(right, forward);
  const float zoom = 2.4F;
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      const float x = (2 * (static_cast<float>(i) + 0.5F) - static_cast<float>(width)) / static_cast<float>(height);
      const float y = (static_cast<float>(height) - 2 * (static_cast<float>(j) + 0.5F)) / static_cast<float>(height);
      const std::optional<Hit> hit = trace(eye, normalized(forward * zoom + right * x + up * y));
      if (!hit) continue;
      const Vec3f lifted = hit->point + hit->normal * 2e-3F;
      const Irradiance e = diffuse(light, hit->normal, [&](Vec3f d) { return !occluded(lifted, d); });
      const std::size_t at =
          static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i);
      out.pixels[at] = reflected_radiance(e, hit->albedo);
      out.alpha[at] = 1;
    }
  }
  return out;
}

/// radiance(d, roughness) of light samples by its definition: the mean weighted by GGX and N·L.
Radiance glossy(const std::vector<LightSample>& light, Vec3f direction, double roughness) {
  const GgxLobe lobe(roughness);
  Radiance sum;
  for (const LightSample& s : light) {
    const double k = lobe.value(dot(vec_cast<double>(s.direction), vec_cast<double>(direction)));
    if (k > 0) sum += s.flux * static_cast<float>(k);
  }
  return sum;
}

constexpr int kMargin = 16, kBallEdge = 170, kStillWidth = 300, kText = 22;
constexpr float kGlossy = 0.5F;

/// Draws a ring around each light in the lens's view, numbered from the strongest. `x`, `y`: the view's corner.
void mark_lights(Page& page, int x, int y, double shrink, const LensParameters& lens, const Lighting& lighting) {
  const CameraModel model(lens);
  int number = 0;
  for (const Light& light : lighting.lights()) {
    ++number;
    const Vec3d d = rotate(lens.pose_cv.rotation.inverse(), vec_cast<double>(light.direction));
    const auto at = model.project(d);
    if (!at) continue;
    const auto [u, v] = tangent_basis(normalized(d));
    const auto rim =
        model.project(normalized(d) + u * std::tan(std::min(1.0, static_cast<double>(light.angular_radius_rad))));
    const double radius = rim ? std::hypot(rim->x - at->x, rim->y - at->y) * shrink : 0;
    page.ring(x + static_cast<int>(at->x * shrink), y + static_cast<int>(at->y * shrink),
              std::max(5, static_cast<int>(radius) + 3), number);
  }
}

/// Radiance towards `d` with the lights as discs, which radiance(d, 0) does not contain.
Radiance mirror(const Lighting& lighting, Vec3f d) {
  Radiance l = lighting.radiance(d, 0).value;
  for (const Light& light : lighting.lights()) {
    const double rho = std::max(0.02, static_cast<double>(light.angular_radius_rad));
    if (dot(d, light.direction) < std::cos(rho)) continue;
    const auto k = static_cast<float>(1 / cap_vector_irradiance(rho));
    l += {light.irradiance.r * k, light.irradiance.g * k, light.irradiance.b * k};
  }
  return l;
}

struct Row {
  LinearPicture diffuse, glossy, mirror, still;
};

Row lit_by(const Lighting& lighting) {
  const Albedo white{0.8F, 0.8F, 0.8F};
  return {ball(kBallEdge, [&](Vec3f n, Vec3f) { return reflected_radiance(lighting.irradiance(n).value, white); }),
          ball(kBallEdge, [&](Vec3f, Vec3f d) { return lighting.radiance(d, kGlossy).value; }),
          ball(kBallEdge, [&](Vec3f, Vec3f d) { return mirror(lighting, d); }),
          still_life(kStillWidth, kBallEdge, samples_of(lighting))};
}

Row lit_by(const sim::Scene& scene, const sim::SceneState& state) {
  const Albedo white{0.8F, 0.8F, 0.8F};
  const std::vector<LightSample> all = samples_of(scene.panorama(state), state.rotation_world_probe);
  return {ball(kBallEdge,
               [&](Vec3f n, Vec3f) { return reflected_radiance(diffuse(all, n, [](Vec3f) { return true; }), white); }),
          ball(kBallEdge, [&](Vec3f, Vec3f d) { return glossy(all, d, kGlossy); }),
          ball(kBallEdge, [&](Vec3f, Vec3f d) { return scene.radiance(vec_cast<double>(d), state); }),
          still_life(kStillWidth, kBallEdge, thinned(all, 1200))};
}

}  // namespace

Status draw_report(const std::string& path, const std::string& title, const sim::Scene& scene,
                   const sim::SceneState& state, const RigParameters& rig, const Lighting& lighting,
                   std::size_t descriptor_bytes, double error) {
  const int row_width = 3 * (kBallEdge + kMargin) + kStillWidth;
  const int lens_width = (row_width - kMargin) / 2;
  const LensParameters& first = rig.lenses.front();
  const int lens_height = lens_width * first.height / first.width;
  const int rows_top = kMargin + 2 * kText + lens_height + kMargin;
  Page page(row_width + 2 * kMargin, rows_top + 2 * (kBallEdge + kText + kMargin) + kText);

  std::string map;
  if (const auto environment = lighting.environment()) {
    const int edge = environment->map.levels.front().edge;
    map = formatted(", a map of %dx%d", edge, edge);
  }
  const std::size_t lights = lighting.lights().size();
  const std::string numbers =
      formatted("%zu light%s, harmonics to band %d%s, %zu bytes; error %.2f %%, bound %.2f %%", lights,
                lights == 1 ? "" : "s", lighting.descriptor().radiance.band, map.c_str(), descriptor_bytes, 100 * error,
                100.0 * lighting.descriptor().bound.total);
  page.write(title + ": what the probe sees, and the lights that it found", kMargin, kMargin + kText / 2);
  page.write(numbers, kMargin, kMargin + kText / 2 + kText);

  const Row truth = lit_by(scene, state), answer = lit_by(lighting);
  const double exposure = exposure_for(truth.diffuse);
  for (std::size_t k = 0; k < rig.lenses.size(); ++k) {
    const LensParameters& lens = rig.lenses[k];
    const std::vector<float> seen = sim::render_radiance(scene, state, lens);
    LinearPicture picture(lens.width, lens.height);
    for (std::size_t at = 0; at < picture.pixels.size(); ++at) {
      picture.pixels[at] = {seen[3 * at], seen[3 * at + 1], seen[3 * at + 2]};
      picture.alpha[at] = 1;
    }
    const int x = kMargin + static_cast<int>(k) * (lens_width + kMargin), y = kMargin + 2 * kText;
    page.paste(picture, x, y, exposure, lens_width);
    mark_lights(page, x, y, static_cast<double>(lens_width) / lens.width, lens, lighting);
  }
  int y = rows_top;
  const auto draw_row = [&](const std::string& caption, const Row& row) {
    page.write(caption, kMargin, y + kText / 2);
    y += kText;
    int x = kMargin;
    for (const LinearPicture* p : {&row.diffuse, &row.glossy, &row.mirror, &row.still}) {
      page.paste(*p, x, y, exposure);
      x += p->width + kMargin;
    }
    y += kBallEdge + kMargin;
  };
  draw_row("lit by the descriptor: matte, glossy (roughness 0.5), mirror; an object with its shadow", answer);
  draw_row("lit by the true panorama", truth);
  return page.save(path);
}

}  // namespace lightwell::hil
