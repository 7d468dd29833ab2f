// Directions and solid angles of the texels of an octahedral map (Engelhardt & Dachsbacher 2008, "Octahedron
// environment maps").
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include <lightwell/octahedral.hpp>

namespace lightwell::estimate {

/// A square of edge x edge texels with samples x samples points each. Solid angles are normalized to a sum of 4 pi.
struct OctahedralGrid {
  struct Sample {
    Vec3f direction;
    float solid_angle;
  };

  OctahedralGrid(int edge_, int samples_) : edge(edge_), samples(samples_), solid_angle(texels()) {
    const int fine = edge * samples;
    sample.reserve(static_cast<std::size_t>(fine) * static_cast<std::size_t>(fine));
    const auto n = static_cast<float>(fine);
    double total = 0;
    for (std::size_t texel = 0; texel < texels(); ++texel) {
      const int i0 = static_cast<int>(texel) % edge * samples, j0 = static_cast<int>(texel) / edge * samples;
      for (int j = j0; j < j0 + samples; ++j)
        for (int i = i0; i < i0 + samples; ++i) {
          const Vec3f d = oct_decode({(static_cast<float>(i) + 0.5F) / n, (static_cast<float>(j) + 0.5F) / n});
          // The square is the unfolded octahedron |x|+|y|+|z| = 1. An area dA of it at the distance r from the centre
          // has a solid angle proportional to dA / r³, with r = 1 / (|x|+|y|+|z|) for the unit vector.
          const double inverse = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
          const double sr = inverse * inverse * inverse;
          sample.push_back({d, static_cast<float>(sr)});
          total += sr;
        }
    }
    const double scale = 4 * std::numbers::pi / total;
    for (std::size_t k = 0; k < sample.size(); ++k) {
      sample[k].solid_angle = static_cast<float>(sample[k].solid_angle * scale);
      solid_angle[k / per_texel()] += sample[k].solid_angle;
    }
  }

  [[nodiscard]] std::size_t texels() const { return static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge); }
  [[nodiscard]] std::size_t per_texel() const {
    return static_cast<std::size_t>(samples) * static_cast<std::size_t>(samples);
  }
  [[nodiscard]] std::size_t texel_of(Vec3f d) const {
    const OctUv uv = oct_encode(d);
    const auto at = [this](float u) { return std::clamp(static_cast<int>(u * static_cast<float>(edge)), 0, edge - 1); };
    return static_cast<std::size_t>(at(uv.v)) * static_cast<std::size_t>(edge) + static_cast<std::size_t>(at(uv.u));
  }

  int edge, samples;
  std::vector<double> solid_angle;  ///< Of each texel, sr.
  std::vector<Sample> sample;       ///< per_texel() for each texel, in the order of texels.
};

}  // namespace lightwell::estimate
