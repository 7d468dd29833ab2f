// Indirect light by final gathering: rays of simulated pixels end at pixels, whose radiosity they take.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/relight.hpp>
#include <lightwell/result.hpp>

#include "rays/ray_scene.hpp"
#include "relight/emitter.hpp"
#include "relight/subject.hpp"

namespace lightwell::relight {

/// A point that rays hit and the camera does not see.
struct HiddenPoint {
  Vec3f origin;  ///< In front of the surface, for rays.
  Vec3f normal;
};

/// Light of one lamp, or of several: irradiance of a matte surface at a pixel and at a hidden point, with occlusion.
class DirectLight {
 public:
  DirectLight(const SubjectData& subject, const RayScene& rays, const BasisLight& light);
  DirectLight(const SubjectData& subject, const RayScene& rays, std::span<const PatternSampler> patterns);

  [[nodiscard]] Irradiance at_pixel(std::size_t pixel) const;
  [[nodiscard]] Irradiance at_hidden(const HiddenPoint& point) const;

 private:
  [[nodiscard]] Irradiance arriving(const Incident& incident, Vec3f origin, Vec3f normal) const;

  const SubjectData& subject_;
  const RayScene& rays_;
  const BasisLight* basis_ = nullptr;
  std::span<const PatternSampler> patterns_;
};

/// The rays of all simulated pixels, cast once for all lights and bounces.
class GatherRays {
 public:
  /// `options` must validate. resource_exhausted where the rays do not fit into kMaxRays.
  [[nodiscard]] static Result<GatherRays> cast(const SubjectData& subject, const RayScene& rays,
                                               const IndirectOptions& options);
  static constexpr std::size_t kMaxRays = std::size_t{1} << 27;

  /// Indirect light of each pixel as reflected radiance, after options.bounces bounces; 0 without geometry.
  void simulate(const DirectLight& light, std::vector<Radiance>& out) const;

  [[nodiscard]] std::size_t simulated_pixels() const { return pixels_.size(); }

 private:
  static constexpr std::uint32_t kMiss = 0xFFFFFFFF;
  struct Neighbours;

  GatherRays(const SubjectData& subject, const IndirectOptions& options) : subject_(&subject), options_(options) {}
  [[nodiscard]] Neighbours neighbours(std::size_t pixel) const;
  void choose_pixels();
  void cast_from(const RayScene& rays, std::size_t pixel);
  [[nodiscard]] std::uint32_t end_of(Vec3f at, Vec3f direction, const RayScene::Hit& hit);
  /// Mean of the radiosity at the ends of a simulated pixel's rays.
  [[nodiscard]] Radiance mean(std::span<const Radiance> radiosity, std::size_t slot) const;

  const SubjectData* subject_;
  IndirectOptions options_;
  std::vector<std::uint32_t> pixels_;  ///< Simulated ones.
  std::vector<std::uint32_t> slots_;   ///< Index in pixels_ of each pixel, or kMiss.
  std::vector<std::uint32_t> ends_;    ///< options_.samples of each: a pixel, pixels + a hidden point, or kMiss.
  std::vector<HiddenPoint> hidden_;
};

}  // namespace lightwell::relight
