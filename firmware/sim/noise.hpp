// Noise that is a pure function of where and when: a counter-based generator, so that a run repeats
// bit for bit whatever its threads do.
#pragma once

#include <cstdint>

namespace lightwell::sim {

/// Two independent uniform numbers in (0, 1).
struct UniformPair {
  double first = 0, second = 0;
};

/// The stream of one picture: SplitMix64 (Steele, Lea & Flood 2014, fig. 15) read at any counter.
class NoiseStream {
 public:
  NoiseStream(std::uint64_t seed, std::uint64_t frame, int lens);

  /// The numbers of one counter, say a pixel's channel.
  [[nodiscard]] UniformPair at(std::uint64_t counter) const;

 private:
  std::uint64_t key_;
};

/// The standard normal quantile of p in (0, 1), to 1e-7 relative: Wichura 1988, algorithm AS 241,
/// PPND7.
[[nodiscard]] double normal_quantile(double p);

/// The Poisson quantile of p for a mean up to about 100, by summing.
[[nodiscard]] int poisson_quantile(double mean, double p);

}  // namespace lightwell::sim
