// Selects the lights, the last SH band and the rounding of a descriptor: the fewest bytes with a predicted error within
// the limits, or the least error within a number of bytes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "estimate/common/cells.hpp"

namespace lightwell::estimate {

/// Limits of the descriptor and of its error.
struct OptimizerOptions {
  int band = kMaxBand;  ///< Highest band.
  int max_lights = 16;
  double epsilon = 0.01;  ///< Limit of the relative RMS error of irradiance; 0: all lights and bands allowed above.
  double radiance_epsilon = 0;   ///< Limit for radiance(d, roughness 0.5); 0: no limit.
  double independent_error = 0;  ///< Expected relative RMS error of irradiance by all other causes (one sigma).
  /// Of lights and residual (lightwell/wire_size.hpp), at least kMaxBand0Bytes; 0: no limit.
  std::size_t max_bytes = 0;
};

/// The part of the descriptor that is not lights, and its error.
struct OptimizedDescriptor {
  /// SH coefficients of the scene minus the selected lights.
  RadianceSh residual;
  float step = 0;            ///< Quantization step of `residual`, a power of two; 0: finest.
  IrradianceRms scene_rms;   ///< RMS irradiance of the scene, lights included.
  IrradianceRms truncation;  ///< RMS irradiance that neither `residual` nor the lights describe.
};

/// Remembers the previous selection for hysteresis. Allocates nothing per frame.
class DescriptorOptimizer {
 public:
  DescriptorOptimizer();

  /// Upper limit on the number of lights to search for before optimize(), `brightest` (may be null) included. A light
  /// costs its bytes, and can save at most the bytes of the cheapest sufficient message with no light or `brightest`
  /// alone. The limit is one above that number, and not below the number sent before, against alternation.
  [[nodiscard]] int max_lights_to_find(const Projection& scene, const Light* brightest, const OptimizerOptions& limits);

  /// Selects lights from `candidates` (strongest first) and fills `out` with the rest of the scene.
  /// candidates[required] is always selected; -1: none. Compares with the previous selection by track. If the result
  /// takes more than limits.max_bytes, it is replaced by the selection with the least predicted error in max_bytes,
  /// which has candidates[required] only where that is less.
  void optimize(const Projection& scene, std::span<const Light> candidates, int required,
                const OptimizerOptions& limits, std::vector<Light>& selected, OptimizedDescriptor& out);

 private:
  static constexpr std::size_t kMaxConsidered = 16;
  static constexpr int kBands = kMaxBand + 1;

  using ResidualSh = std::array<BasisRow, 3>;  ///< SH coefficients by channel.
  struct Configuration {
    std::size_t lights = 0;
    int band = 0;
    double bytes = 0, error_ratio = 0;  ///< `error_ratio`: the largest ratio of a predicted error to its limit.
    float step = 0;                     ///< As OptimizedDescriptor::step.
  };

  /// RMS of the scene, the denominator of relative errors.
  struct ReferenceRms {
    IrradianceRms irradiance, radiance;
  };

  /// Sets residuals_[0] to the scene, and returns its RMS.
  [[nodiscard]] ReferenceRms begin(const Projection& scene);
  /// SH coefficients of the light's cap with a vector irradiance of 1.
  [[nodiscard]] static BasisRow shape_of(const Light& light);
  void subtract(const Light& light, const BasisRow& shape, ResidualSh& residual) const;
  /// Calls `visit(Configuration)` for residuals_[lights] and each last band.
  template <class Visit>
  void for_each_band(std::size_t lights, const OptimizerOptions& limits, const ReferenceRms& reference,
                     Visit&& visit) const;
  /// Mean squares of irradiance and radiance by the bands above each last band: [band][channel].
  void truncation_energy(const ResidualSh& residual, bool all_bands, double (&irradiance)[kBands][3],
                         double (&radiance)[kBands][3]) const;
  [[nodiscard]] double residual_energy_above_band2(const ResidualSh& residual, const Light& light,
                                                   const BasisRow& shape, float inverse_mean_square) const;
  void order_lights(std::span<const Light> candidates, int required, std::size_t most, float inverse_mean_square);
  [[nodiscard]] bool was_selected(std::uint32_t track) const;
  /// Whether the first `count` of the ordered lights are the previous selection.
  [[nodiscard]] bool were_selected(std::span<const Light> candidates, std::size_t count) const;
  /// The fewest bytes whose errors are within their limits. Requires limits.epsilon > 0 and order_lights().
  [[nodiscard]] Configuration fewest_bytes(std::span<const Light> candidates, int required,
                                           const OptimizerOptions& limits, const ReferenceRms& reference) const;
  /// The least error within limits.max_bytes. Requires order_lights().
  [[nodiscard]] Configuration least_error(std::span<const Light> candidates, const OptimizerOptions& limits,
                                          const ReferenceRms& reference) const;
  /// Upper limit of the bytes of a configuration's lights and residual on the wire.
  [[nodiscard]] std::size_t wire_bytes(std::span<const Light> candidates, const Configuration& configuration,
                                       const OptimizerOptions& limits) const;

  std::vector<BasisRow> shapes_;
  std::vector<ResidualSh> residuals_;  ///< After subtraction of 0, 1, 2, ... lights.
  std::vector<std::size_t> order_;     ///< Indices of candidates, in greedy order.
  std::vector<std::uint32_t> previous_tracks_;
  int previous_band_ = -1;
};

}  // namespace lightwell::estimate
