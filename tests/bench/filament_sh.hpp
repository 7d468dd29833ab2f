// Peer: Filament's conversion of a panorama to nine coefficients (its libibl, as called by its tool cmgen):
// equirectangular to a cube with 256x256 texels per face, then a projection onto three bands.
// cmgen also compresses radiance above 4,096 and windows coefficients that ring; both are omitted here, because they
// change the result.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "bench/equirect_image.hpp"

namespace lightwell::bench {

struct FilamentSh {
  /// Radiance in the order and signs of proto/README.md. Filament's coefficients have the Condon-Shortley phase and +Z
  /// in the centre of the image: coefficient l, m is (-1)^l times Filament's.
  std::array<Triple, 9> radiance{};
  double cube_s = 0;  ///< Panorama to cube.
  double sh_s = 0;    ///< Cube to coefficients.
};

/// Filament samples few pixels per texel: the energy of a sun of one pixel has an error of up to a tenth of the whole
/// light. Owns Filament's engine (its no-op backend, the only access to its job system with Debian's headers) and the
/// image in Filament's layout, so that neither start-up nor copying is measured. Filament's threads and run() are
/// pinned to one processor, so the times are comparable with one thread. Not thread-safe.
class FilamentRoute {
 public:
  /// False if the project was built without libfilament-dev; then load() and run() do nothing.
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
