#include "estimate/marker/gloss.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <lightwell/quantile.hpp>

namespace lightwell::marker {
namespace {

/// Standard deviation of a specular reflection relative to itself: it varies over a face.
constexpr double kGlossRelativeSigma = 0.7;
/// Largest standard deviation of the ink's radiance, relative to that of the paper; above it, the ink is not used.
constexpr double kMaxInkSigma = 0.01;

struct GlossyFace {
  int surface = 0;
  double irradiance = 0;  ///< Mean over the samples, the specular part included.
  double ink_albedo = 0;  ///< Apparent: pi * radiance of the ink / irradiance.
  double paper_albedo = 0;
};

}  // namespace

void subtract_gloss(Shading& shading) {
  std::vector<GlossyFace> faces;
  for (const InkSample& ink : shading.ink) {
    GlossyFace face{.surface = ink.surface, .paper_albedo = ink.paper_albedo};
    double count = 0;
    for (const SurfaceSample& s : shading.samples)
      if (s.surface == ink.surface) face.irradiance += luminance(s.irradiance), ++count;
    face.irradiance /= std::max(1.0, count);
    if (!(face.irradiance > 0) || !std::isfinite(ink.radiance) || !(ink.paper_albedo > 2 * kMaxInkAlbedo)) continue;
    if (!(std::numbers::pi * ink.sigma <= kMaxInkSigma * ink.paper_albedo * face.irradiance)) continue;
    face.ink_albedo = std::numbers::pi * ink.radiance / face.irradiance;
    faces.push_back(face);
  }
  if (faces.empty()) return;
  const double ink_albedo =
      std::clamp(std::ranges::min_element(faces, {}, &GlossyFace::ink_albedo)->ink_albedo, 0.0, kMaxInkAlbedo);
  // Share of the irradiance that is specular: E' = E + pi s / a and i' E' = i E + pi s give (i' - i) / (a - i), with
  // paper of albedo a, ink of albedo i and apparent albedo i', specular radiance s.
  const auto specular_share = [&](const GlossyFace& face) {
    return std::clamp((face.ink_albedo - ink_albedo) / (face.paper_albedo - ink_albedo), 0.0, 1.0);
  };
  std::vector<double> shares;
  for (const GlossyFace& face : faces) shares.push_back(specular_share(face));
  const double usual = order_statistic(shares, shares.size() / 2);
  for (SurfaceSample& s : shading.samples) {
    const auto face = std::ranges::find(faces, s.surface, &GlossyFace::surface);
    if (face == faces.end()) {
      for (std::size_t c = 0; c < 3; ++c) s.sigma[c] = std::hypot(s.sigma[c], usual * s.irradiance[c]);
      continue;
    }
    const double share = specular_share(*face);
    const double scale = face->irradiance / std::max(1e-300, luminance(s.irradiance));
    for (std::size_t c = 0; c < 3; ++c) {
      // The same radiance over the whole face, of the sample's colour.
      const double specular = std::min(share * scale, 1.0) * s.irradiance[c];
      s.irradiance[c] -= specular;
      s.sigma[c] = std::hypot(s.sigma[c], kGlossRelativeSigma * specular);
    }
  }
}

}  // namespace lightwell::marker
