#include "ar_viewer/split_sum.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace lightwell::viewer {
namespace {

constexpr int kEdge = 32;
constexpr int kSamples = 256;

/// The digits of i in base 2 behind the point.
double radical_inverse(std::uint32_t i) {
  double value = 0;
  for (double digit = 0.5; i != 0; i >>= 1U, digit /= 2) value += digit * (i & 1U);
  return value;
}

}  // namespace

std::array<float, 2> directional_albedo(double nv, double roughness) {
  const double alpha = std::max(roughness * roughness, 1e-4), alpha2 = alpha * alpha;
  const double cosine = std::clamp(nv, 1e-3, 1.0), sine = std::sqrt(1 - cosine * cosine);
  const double smith_eye = std::sqrt(alpha2 + (1 - alpha2) * cosine * cosine);
  double scale = 0, bias = 0;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    // Half vectors in the proportion of GGX times their cosine.
    const double u = (i + 0.5) / kSamples, phi = 2 * std::numbers::pi * radical_inverse(i);
    const double nh = std::sqrt((1 - u) / (1 + (alpha2 - 1) * u)), sh = std::sqrt(1 - nh * nh);
    const double vh = sine * sh * std::cos(phi) + cosine * nh;
    const double nl = 2 * vh * nh - cosine;
    if (nl <= 0 || vh <= 0) continue;
    const double smith_light = std::sqrt(alpha2 + (1 - alpha2) * nl * nl);
    const double visible = 2 * nl * vh / (nh * (nl * smith_eye + cosine * smith_light));
    const double fresnel = std::pow(1 - vh, 5);
    scale += (1 - fresnel) * visible;
    bias += fresnel * visible;
  }
  return {static_cast<float>(scale / kSamples), static_cast<float>(bias / kSamples)};
}

GlTexture make_split_sum_table() {
  std::vector<float> texels;
  for (int row = 0; row < kEdge; ++row)
    for (int column = 0; column < kEdge; ++column) {
      const auto factors = directional_albedo((column + 0.5) / kEdge, (row + 0.5) / kEdge);
      texels.insert(texels.end(), factors.begin(), factors.end());
    }
  GlTexture texture;
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RG32F, kEdge, kEdge, 0, GL_RG, GL_FLOAT, texels.data());
  set_sampling(GL_TEXTURE_2D, GL_LINEAR, GL_LINEAR, GL_CLAMP_TO_EDGE);
  return texture;
}

}  // namespace lightwell::viewer
