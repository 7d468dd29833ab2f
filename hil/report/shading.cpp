#include "report/shading.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <lightwell/lobes.hpp>

namespace lightwell::hil {
namespace {

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

}  // namespace

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
      Irradiance e;
      const Vec3f lifted = hit->point + hit->normal * 2e-3F;
      for (const LightSample& s : light) {
        const float c = dot(s.direction, hit->normal);
        if (c <= 0 || occluded(lifted, s.direction)) continue;
        e += Irradiance{s.flux.r * c, s.flux.g * c, s.flux.b * c};
      }
      const std::size_t at =
          static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i);
      out.pixels[at] = reflected_radiance(e, hit->albedo);
      out.alpha[at] = 1;
    }
  }
  return out;
}

Radiance glossy(const std::vector<LightSample>& light, Vec3f direction, double roughness) {
  const GgxLobe lobe(roughness);
  Radiance sum;
  for (const LightSample& s : light) {
    const double k = lobe.value(dot(vec_cast<double>(s.direction), vec_cast<double>(direction)));
    if (k > 0) sum += s.flux * static_cast<float>(k);
  }
  return sum;
}

Irradiance diffuse(const std::vector<LightSample>& light, Vec3f normal) {
  Irradiance e;
  for (const LightSample& s : light) {
    const float c = dot(s.direction, normal);
    if (c > 0) e += Irradiance{s.flux.r * c, s.flux.g * c, s.flux.b * c};
  }
  return e;
}

}  // namespace lightwell::hil
