// Counter-based noise generator: noise is a pure function of seed, frame, lens and pixel, so that results are
// bit-identical for any number of threads.
#pragma once

#include <cstdint>

namespace lightwell::sim {

/// Two independent uniform numbers in (0, 1).
struct UniformPair {
  double first = 0, second = 0;
};

/// The noise of one picture: SplitMix64 (Steele, Lea & Flood 2014, fig. 15) with random access by counter.
class NoiseStream {
 public:
  NoiseStream(std::uint64_t seed, std::uint64_t frame, int lens);

  /// The numbers of one counter, for instance of one channel of a pixel.
  [[nodiscard]] UniformPair at(std::uint64_t counter) const;

 private:
  std::uint64_t key_;
};

/// The standard normal quantile of p in (0, 1), relative error 1e-7 (Wichura 1988, algorithm AS 241, PPND7).
[[nodiscard]] double normal_quantile(double p);

/// The Poisson quantile of p for a mean up to about 100, by summation.
[[nodiscard]] int poisson_quantile(double mean, double p);

}  // namespace lightwell::sim
