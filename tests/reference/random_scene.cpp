#include "reference/random_scene.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "reference/harmonics.hpp"

namespace lightwell::reference {

RandomScene::RandomScene(std::uint32_t seed, int lamp_count) : darkest(0.01) {
  std::mt19937 random(seed);
  // The standard's distributions differ from library to library.
  const auto uniform = [&random] { return (random() + 0.5) / 4294967296.0; };
  // A grey of 0.4 to 0.5 (Y_0 is 0.2821), and a spectrum that falls with the square of the band.
  harmonics.resize(49);
  for (int l = 0; l <= 6; ++l) {
    for (int m = -l; m <= l; ++m) {
      Rgb& c = harmonics[static_cast<std::size_t>(harmonic_index(l, m))];
      const double grey = 2 * uniform() - 1;
      for (double& v : c)
        v = l == 0 ? (0.4 + 0.1 * uniform()) / 0.28209479 : 0.35 / (1.0 + l * l) * (grey + uniform() - 0.5);
    }
  }
  for (int k = 0; k < lamp_count; ++k) {
    const double z = 2 * uniform() - 1, a = 2 * pi * uniform(), ring = std::sqrt(1 - z * z), bright = 1 + 4 * uniform();
    lamps.push_back({{ring * std::cos(a), ring * std::sin(a), z},
                     0.1 + 0.25 * uniform(),
                     {bright, bright * (0.7 + 0.3 * uniform()), bright * (0.4 + 0.6 * uniform())}});
  }
}

Rgb RandomScene::radiance(const V3& direction) const {
  Rgb l = evaluate(harmonics, direction);
  for (double& v : l) v = std::max(v, darkest);
  for (const SoftLamp& lamp : lamps) {
    const double a = angle_deg(direction, lamp.towards) * pi / 180,
                 falls = std::exp(-0.5 * a * a / (lamp.deviation_rad * lamp.deviation_rad));
    for (std::size_t c = 0; c < 3; ++c) l[c] += falls * lamp.peak[c];
  }
  return l;
}

}  // namespace lightwell::reference
