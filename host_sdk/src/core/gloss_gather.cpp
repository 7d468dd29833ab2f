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
/// A surfel is not divided if its share of the lobe times its change is less than this times tolerance².
constexpr float kNegligible = 0.01F;
/// Least squared distance, texels².
constexpr float kMinSquare = 1e-12F;
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

/// The lobe at a point of the plane, and what is the same for all surfels.
struct Lobe {
  Lobe(const SpecularBrdf& brdf, float at_x, float at_y, Vec3f to_viewer)
      : x(at_x), y(at_y), v(to_viewer), alpha2(square_of(std::max(brdf.alpha, SpecularBrdf::kMinAlpha))), f0(brdf.f0) {
    masking = std::sqrt(alpha2 + (1 - alpha2) * v.z * v.z);
    const float ring = std::sqrt(v.x * v.x + v.y * v.y);
    if (!(ring > 0)) return;
    along_x = v.x / ring;
    along_y = v.y / ring;
  }

  float x, y;
  Vec3f v;
  float alpha2, f0;
  float masking;                   ///< sqrt(alpha² + (1 - alpha²) (n·v)²)
  float along_x = 1, along_y = 0;  ///< The viewer's azimuth; any direction where the viewer is at the normal.

 private:
  static float square_of(float value) { return value * value; }
};

struct GroupShares {
  std::array<float, 4> share;   ///< f n·l times the solid angle.
  std::array<float, 4> angle2;  ///< Squared radius over squared distance.
  std::array<float, 4> width2;  ///< Squared angle of l over which the lobe changes.
};

/// Without branches, so that it vectorises.
GroupShares evaluate(const Lobe& lobe, const SurfelGroup& group) {
  GroupShares out;
  const float alpha2 = lobe.alpha2, f0 = lobe.f0;
  for (std::size_t k = 0; k < 4; ++k) {
    const float to_x = group.x[k] - lobe.x, to_y = group.y[k] - lobe.y, to_z = group.z[k];
    const float square = std::max(to_x * to_x + to_y * to_y + to_z * to_z, kMinSquare);
    const float inverse = 1 / std::sqrt(square), inverse2 = inverse * inverse;
    const float l_z = to_z * inverse;
    const float facing = -(group.area_x[k] * to_x + group.area_y[k] * to_y + group.area_z[k] * to_z) * inverse;
    // v + l, twice the half vector times its cosine, along the viewer's azimuth and across it.
    const float sum_x = lobe.v.x + to_x * inverse, sum_y = lobe.v.y + to_y * inverse, sum_z = lobe.v.z + l_z;
    const float along = sum_x * lobe.along_x + sum_y * lobe.along_y;
    const float across = sum_y * lobe.along_x - sum_x * lobe.along_y;
    const float level2 = along * along + across * across, sum_z2 = sum_z * sum_z, sum2 = level2 + sum_z2;
    // A change of l by an angle, vertically or horizontally, changes the slope of the half vector by that angle over 2
    // or over sum_z.
    const float angle2 = group.radius2[k] * inverse2;
    const float widening = group.children[k] != 0 ? kWidening : kPixelWidening;
    const float along2 = alpha2 + widening * std::min(1.0F, angle2 * 0.25F);
    const float across2 = alpha2 + widening * std::min(1.0F, angle2 / sum_z2);
    // GGX with two widths (Burley 2012, "Physically-Based Shading at Disney", eq. 13), with h.z² = sum_z² / sum2:
    // sum2² P^1.5 / (pi (along² across2 + across² along2 + P sum_z²)²), P = along2 across2.
    const float product = along2 * across2;
    const float d = along * along * across2 + across * across * along2 + product * sum_z2;
    // As SpecularBrdf: G2 / (4 n·v n·l) and Schlick's term at v·h = sqrt(sum2) / 2.
    const float masking = l_z * lobe.masking + lobe.v.z * std::sqrt(alpha2 + (1 - alpha2) * l_z * l_z);
    const float m = std::max(0.0F, 1 - 0.5F * std::sqrt(sum2)), m2 = m * m;
    const float fresnel = f0 + (1 - f0) * m2 * m2 * m;
    const float share = sum2 * sum2 * product * std::sqrt(product) * 0.5F * fresnel * l_z * facing * inverse2 /
                        (std::numbers::pi_v<float> * d * d * masking);
    out.share[k] = facing > 0 && l_z > 0 ? share : 0.0F;
    out.angle2[k] = angle2;
    out.width2[k] = alpha2 * sum_z2 + level2;
  }
  return out;
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

GlossGather::Sum GlossGather::gather(std::span<const SurfelGroup> groups, float x, float y, Vec3f v,
                                     float tolerance) const {
  Sum out;
  if (groups.empty()) return out;
  const Lobe lobe(brdf_, x, y, v);
  const float all = albedo(v.z);
  const float tolerance2 = tolerance * tolerance, limit = kNegligible * tolerance2 * all;
  // Of each of at most 12 levels three groups wait.
  std::array<std::uint32_t, 64> stack{};
  std::size_t waiting = 0;
  stack[waiting++] = static_cast<std::uint32_t>(groups.size());
  float weight = 0;
  while (waiting > 0) {
    const SurfelGroup& group = groups[stack[--waiting] - 1];
    const GroupShares shares = evaluate(lobe, group);
    for (std::size_t k = 0; k < 4; ++k) {
      // The change of the lobe over the surfel is its angle over this width.
      const float angle2 = shares.angle2[k], width2 = shares.width2[k];
      const bool divides = angle2 > tolerance2 * width2 && shares.share[k] * angle2 > limit * width2;
      if (group.children[k] != 0 && (divides || angle2 >= 1)) {
        stack[waiting++] = group.children[k];
        continue;
      }
      const float share = shares.share[k];
      weight += share;
      out.reflected += Radiance{group.red[k], group.green[k], group.blue[k]} * share;
    }
  }
  if (!(weight > 0) || !std::isfinite(weight) || !(all > 0)) return {};
  out.hidden = weight / all;
  if (out.hidden > 1) {
    out.reflected = out.reflected * (1 / out.hidden);
    out.hidden = 1;
  }
  return out;
}

}  // namespace lightwell::core
