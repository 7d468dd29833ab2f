#include "core/gloss_gather.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace lightwell::core {
namespace {

/// Grazing directions are evaluated at this cosine.
constexpr float kMinAlbedoCosine = 1e-3F;
/// The lobe is widened by the size of what it is evaluated for: alpha² grows by this times the squared radius in slopes
/// of the half vector. A disc of uniform density has the variance 1/4 along each axis; single pixels must overlap.
constexpr float kWidening = 0.25F, kPixelWidening = 1;
/// Half vectors of the albedo's quadrature: azimuths over half a turn, and slopes.
constexpr int kAzimuths = 16, kSlopes = 48;

/// The integral of f n·l over l, by half vectors of equal share of the distribution (Walter et al. 2007, eq. 35 and
/// 41).
float directional_albedo(const SpecularBrdf& brdf, float cosine) {
  const float alpha = std::max(brdf.alpha, SpecularBrdf::kMinAlpha);
  const Vec3f v{std::sqrt(1 - cosine * cosine), 0, cosine};
  double sum = 0;
  for (int i = 0; i < kSlopes; ++i) {
    const float share = (static_cast<float>(i) + 0.5F) / kSlopes;
    const float slope = alpha * std::sqrt(share / (1 - share));
    const float z = 1 / std::sqrt(1 + slope * slope), ring = slope * z;
    for (int k = 0; k < kAzimuths; ++k) {
      const float azimuth = std::numbers::pi_v<float> * (static_cast<float>(k) + 0.5F) / kAzimuths;
      const Vec3f h{ring * std::cos(azimuth), ring * std::sin(azimuth), z};
      const float v_dot_h = dot(v, h);
      if (!(v_dot_h > 0)) continue;
      const Vec3f l = h * (2 * v_dot_h) - v;
      // Density of l: D n·h / (4 v·h), with D = alpha² / (pi (h.x² + h.y² + alpha² h.z²)²).
      const float d = ring * ring + alpha * alpha * z * z;
      const float density = alpha * alpha / (std::numbers::pi_v<float> * d * d) * z / (4 * v_dot_h);
      if (density > 0) sum += static_cast<double>(brdf.times_cosine(v, l) / density);
    }
  }
  return std::clamp(static_cast<float>(sum / (kSlopes * kAzimuths)), 0.0F, 1.0F);
}

}  // namespace

void GlossGather::set(const SpecularBrdf& brdf) {
  if (brdf.alpha == brdf_.alpha && brdf.f0 == brdf_.f0) return;
  brdf_ = brdf;
  for (int k = 0; k <= kSteps; ++k) {
    const float root = static_cast<float>(k) / kSteps;
    albedo_[static_cast<std::size_t>(k)] = directional_albedo(brdf, std::clamp(root * root, kMinAlbedoCosine, 1.0F));
  }
}

float GlossGather::albedo(float cosine) const {
  const float at = std::sqrt(std::clamp(cosine, 0.0F, 1.0F)) * kSteps;
  const int k = std::min(static_cast<int>(at), kSteps - 1);
  const float f = at - static_cast<float>(k);
  return albedo_[static_cast<std::size_t>(k)] * (1 - f) + albedo_[static_cast<std::size_t>(k) + 1] * f;
}

GlossGather::Sum GlossGather::gather(const Surfel* root, std::span<const Surfel> surfels, float x, float y, Vec3f v,
                                     float tolerance) const {
  Sum out;
  if (root == nullptr) return out;
  const float a2 = std::max(brdf_.alpha, SpecularBrdf::kMinAlpha) * std::max(brdf_.alpha, SpecularBrdf::kMinAlpha);
  const float tolerance2 = tolerance * tolerance;
  // Along the viewer's azimuth; any direction where the viewer is at the normal.
  const float ring = std::sqrt(v.x * v.x + v.y * v.y);
  const float along_x = ring > 0 ? v.x / ring : 1, along_y = ring > 0 ? v.y / ring : 0;
  // Of each of at most 22 levels three siblings wait.
  std::array<const Surfel*, 96> stack{};
  std::size_t waiting = 0;
  stack[waiting++] = root;
  float weight = 0;
  while (waiting > 0) {
    const Surfel& node = *stack[--waiting];
    const Vec3f to{node.position.x - x, node.position.y - y, node.position.z};
    const float square = dot(to, to);
    const float inverse = square > 0 ? 1 / std::sqrt(square) : 0;
    const Vec3f l = to * inverse;
    const Vec3f sum = v + l;
    // Slope of the half vector along the viewer's azimuth and across it, and by how much it varies over the node: a
    // change of l by an angle, vertically or horizontally, changes it by that angle over 2 or over 2 n·v.
    const float along = (sum.x * along_x + sum.y * along_y) / sum.z;
    const float across = (sum.y * along_x - sum.x * along_y) / sum.z;
    const float angle = node.radius * inverse, extent = angle / sum.z;
    const bool inside = node.radius * node.radius >= square;
    if (node.count > 0 && (inside || extent * extent > tolerance2 * (a2 + along * along + across * across))) {
      for (std::uint32_t k = 0; k < node.count; ++k) stack[waiting++] = &surfels[node.children + k];
      continue;
    }
    const float facing = -dot(node.area, l);
    if (!(facing > 0) || !(l.z > 0)) continue;
    const float widening = node.count > 0 ? kWidening : kPixelWidening;
    const float along2 = a2 + widening * std::min(1.0F, angle * angle / 4);
    const float across2 = a2 + widening * std::min(1.0F, extent * extent);
    // GGX with two widths (Burley 2012, "Physically-Based Shading at Disney", eq. 13); h.z² = sum.z² / |sum|².
    const float d = along * along / along2 + across * across / across2 + 1;
    const float sum2 = dot(sum, sum), secant2 = sum2 / (sum.z * sum.z);
    const float distribution = secant2 * secant2 / (std::numbers::pi_v<float> * std::sqrt(along2 * across2) * d * d);
    const float share = distribution * brdf_.without_distribution(v, l, sum2) * facing * inverse * inverse;
    weight += share;
    out.reflected += node.radiance * share;
  }
  const float all = albedo(v.z);
  if (!(weight > 0) || !std::isfinite(weight) || !(all > 0)) return {};
  out.hidden = weight / all;
  if (out.hidden > 1) {
    out.reflected = out.reflected * (1 / out.hidden);
    out.hidden = 1;
  }
  return out;
}

}  // namespace lightwell::core
