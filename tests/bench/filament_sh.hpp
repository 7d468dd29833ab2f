// Peer: Filament's way from a panorama to nine coefficients (its libibl, as its tool cmgen calls it):
// equirectangular to a cube of 256x256 a face, then a projection onto three bands.
// cmgen besides compresses radiance above 4,096 and, where the coefficients ring, windows them: left out, since both
// change the answer.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "bench/equirect_image.hpp"

namespace lightwell::bench {

struct FilamentSh {
  /// Radiance, in the house's order and signs. Filament's own have the Condon-Shortley phase and +Z in
  /// the middle of the picture: coefficient l, m is (-1)^l times its.
  std::array<Triple, 9> radiance{};
  double cube_s = 0;  ///< Panorama to cube.
  double sh_s = 0;    ///< Cube to coefficients.
};

/// Its cube takes single pixels, few a texel: a sun of one pixel comes out with up to a tenth of the whole light too
/// much or too little. Owns Filament's engine (its no-op back end, for its job system, the only way to it that Debian's
/// headers leave) and the picture in Filament's own layout, so that neither start-up nor copying is
/// counted. Filament's threads and run() stay on one processor: the times are of one thread.
/// One thread at a time.
class FilamentRoute {
 public:
  /// False where the project was built without libfilament-dev; then load() and run() do nothing.
  [[nodiscard]] static bool available();

  FilamentRoute();
  ~FilamentRoute();
  FilamentRoute(const FilamentRoute&) = delete;
  FilamentRoute& operator=(const FilamentRoute&) = delete;

  void load(const EquirectImage& image);
  [[nodiscard]] FilamentSh run();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lightwell::bench
