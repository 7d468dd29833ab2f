// The subject of the relighting figures: path-traced photographs under 29 basis lights, and its true pictures under
// patterns, kept in files.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/relight.hpp>
#include <lightwell/result.hpp>

#include "reference/relight/path_tracer.hpp"

namespace lightwell::measure {

/// The number of the paper.
inline constexpr std::size_t kBasisLights = 29;

/// A pattern that the subject is lit by in a true picture.
struct PatternCase {
  std::string name;
  reference::TracedLight light;
};

/// Blinds and stained glass, each at the place of a basis light and between basis lights.
[[nodiscard]] const std::vector<PatternCase>& pattern_cases();

/// The basis lights as they are traced, and as the library has them.
[[nodiscard]] std::vector<reference::TracedLight> traced_basis();
[[nodiscard]] std::vector<BasisLight> basis_lights();

/// The pattern as the library has it: its picture is rasterised in 1024 x 1024 texels of 2 x 2 samples. `picture` is
/// its memory.
[[nodiscard]] PatternLight pattern_light(const PatternCase& pattern, std::vector<RgbFactor>& picture);

/// How many pixels and paths the renders have.
struct RelightRenderSize {
  int columns = 320, rows = 240;
  int basis_samples = 100, truth_samples = 400;
};

struct RelightRenders {
  RelightCamera camera;
  std::vector<float> coverage, depth_m;
  std::vector<Albedo> albedo;
  std::vector<Vec3f> normals;
  std::vector<std::vector<Radiance>> photographs;  ///< Under each basis light.
  std::vector<std::vector<Radiance>> truth;        ///< Under the pattern of each case, with all bounces.
  std::vector<std::vector<Radiance>> truth_direct;

  [[nodiscard]] std::size_t pixels() const { return coverage.size(); }
  /// Whether the subject covers all of a pixel. Others take no part in the figures.
  [[nodiscard]] bool is_subject(std::size_t pixel) const { return coverage[pixel] > 0.999F && depth_m[pixel] > 0; }
};

/// Reads the renders from `folder`, or renders them there by two threads: minutes. The file's name contains a checksum
/// of a small render, so that another scene has another file. An empty folder name: nothing is kept.
[[nodiscard]] Result<RelightRenders> relight_renders(const RelightRenderSize& size, const std::string& folder);

}  // namespace lightwell::measure
