// light_client as a child process, with Debian's loader, the layer and the simulated runtime, and what it prints.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "support/child.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {

/// The simulated runtime's XrTime at 0 of CLOCK_MONOTONIC.
inline constexpr std::int64_t kXrEpoch = 5'000'000'000'000'000'000;

/// How the loader finds the layer.
enum class LayerKind {
  none,
  explicit_layer,  ///< XR_API_LAYER_PATH and XR_ENABLE_API_LAYERS.
  implicit_layer,  ///< A folder of XDG_DATA_HOME.
};

struct LayerSetup {
  LayerKind kind = LayerKind::explicit_layer;
  /// LIGHTWELL_XR_...=value, SIMULATED_XR_LACKS=..., and further ones.
  std::vector<std::string> environment{};
};

/// The environment of a client in `folder`, where it writes the manifest of the runtime.
[[nodiscard]] ChildOptions layer_environment(const TempDir& folder, const LayerSetup& setup);

/// The command line of light_client.
[[nodiscard]] std::vector<std::string> client_command(std::vector<std::string> arguments);

/// A line `light` of the client.
struct LightLine {
  int session = -1;
  std::int64_t host_ns = 0;  ///< When it called xrGetLightEstimateANDROID.
  std::int64_t took_ns = 0;  ///< The call.
  std::int64_t time = 0;     ///< XrTime that it asked for.
  int result = -1;
  int state = -1;  ///< 0 VALID, 1 INVALID.
  std::int64_t updated = 0;
  std::array<float, 7> T_space_local{};  ///< Quaternion, position.
  int directional_state = -1;
  std::array<float, 6> directional{};
  int ambient_state = -1;
  std::array<float, 6> ambient{};
  int harmonics_state = -1;
  std::array<float, 27> coefficients{};

  [[nodiscard]] bool valid() const { return state == 0; }
};

/// A line `cube` of the client.
struct CubeLine {
  int session = -1;
  int state = -1;
  std::int64_t center_exposure = 0;
  std::array<float, 4> rotation{};
  std::string hash;  ///< FNV-1a, 16 hexadecimal digits, of right, left, top, bottom, front, back.
};

[[nodiscard]] std::vector<LightLine> light_lines(const std::string& out);
[[nodiscard]] std::vector<CubeLine> cube_lines(const std::string& out);
/// The lines that begin with `word`, without it.
[[nodiscard]] std::vector<std::string> lines_of(const std::string& out, const std::string& word);

}  // namespace lightwell::test
