// Analytic scenes, and random numbers that are the same on every machine.
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell::extremes {

/// Uniform radiance within `radius_rad` of `axis` (unit), added to the ambient radiance.
struct Disc {
  Vec3d axis;
  double radius_rad = 0;
  Radiance radiance;
};

struct Scene {
  std::function<Radiance(Vec3d)> ambient;
  std::vector<Disc> discs;
};

/// Random distributions; those of the standard library differ between implementations.
class Chance {
 public:
  explicit Chance(std::uint32_t seed) : engine_(seed) {}
  std::uint32_t bits() { return static_cast<std::uint32_t>(engine_()); }
  /// In [low, high).
  double between(double low, double high) { return low + (high - low) * (bits() / 4294967296.0); }
  /// Log-uniform.
  double magnitude(double low, double high);
  int below(int count) { return static_cast<int>(between(0, count)); }
  Vec3d direction();
  Quat rotation();

 private:
  std::mt19937 engine_;
};

[[nodiscard]] Scene constant(Radiance radiance);
/// A sky, walls with soft edges, a few wide glows, and up to `most_discs` discs with diameters of 2 to 12 degrees.
[[nodiscard]] Scene room(Chance& chance, int most_discs = 4);
/// The scene rotated by q.
[[nodiscard]] Scene turned(const Scene& scene, Quat q);
[[nodiscard]] Scene scaled(const Scene& scene, float factor);

/// Radiance of a grey disc that is `times` the mean over the sphere of the disc and `ambient` together.
[[nodiscard]] float radiance_times_mean(double times, double radius_rad, float ambient);

}  // namespace lightwell::extremes
