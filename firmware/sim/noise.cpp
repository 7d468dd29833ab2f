#include "sim/noise.hpp"

#include <algorithm>
#include <cmath>

namespace lightwell::sim {

namespace {

constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15;

std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
  return z ^ (z >> 31);
}

/// The centre of one of 2^32 equal cells of [0, 1], which is never 0 or 1.
double unit(std::uint32_t bits) { return (bits + 0.5) / 4294967296.0; }

}  // namespace

NoiseStream::NoiseStream(std::uint64_t seed, std::uint64_t frame, int lens)
    : key_(mixed(mixed(mixed(seed + kGolden) + frame + kGolden) + static_cast<std::uint64_t>(lens) + kGolden)) {}

UniformPair NoiseStream::at(std::uint64_t counter) const {
  const std::uint64_t bits = mixed(key_ + (counter + 1) * kGolden);
  return {unit(static_cast<std::uint32_t>(bits >> 32)), unit(static_cast<std::uint32_t>(bits))};
}

double normal_quantile(double p) {
  const double q = p - 0.5;
  if (std::abs(q) <= 0.425) {
    const double r = 0.180625 - q * q;
    return q * (((59.109374720 * r + 159.29113202) * r + 50.434271938) * r + 3.3871327179) /
           (((67.187563600 * r + 78.757757664) * r + 17.895169469) * r + 1.0);
  }
  double r = std::sqrt(-std::log(std::min(p, 1 - p)));
  double value = 0;
  if (r <= 5) {
    r -= 1.6;
    value = (((0.17023821103 * r + 1.3067284816) * r + 2.7568153900) * r + 1.4234372777) /
            ((0.12021132975 * r + 0.73700164250) * r + 1.0);
  } else {
    r -= 5;
    value = (((0.017337203997 * r + 0.42868294337) * r + 3.0812263860) * r + 6.6579051150) /
            ((0.012258202635 * r + 0.24197894225) * r + 1.0);
  }
  return q < 0 ? -value : value;
}

int poisson_quantile(double mean, double p) {
  double term = std::exp(-mean), sum = term;
  int count = 0;
  // For p near 1, rounding may keep the sum below p; the limit ends the tail, whose terms are negligible.
  while (sum < p && count < 1000) {
    ++count;
    term *= mean / count;
    sum += term;
  }
  return count;
}

}  // namespace lightwell::sim
