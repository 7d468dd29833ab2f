// As rich as needed: which lights and which bands describe a frame well enough in the fewest bytes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "estimate/common/cells.hpp"
#include "estimate/common/spectrum.hpp"

namespace lightwell::estimate {

/// What an answer may be, and how good it has to be.
struct OptimizerOptions {
  int band = kMaxBand;  ///< Highest band.
  int max_lights = 16;
  double epsilon = 0.01;        ///< Relative RMS error of irradiance; 0: as rich as the two above allow.
  double radiance_epsilon = 0;  ///< The same of radiance(d, 0.5); 0: no such limit.
  double independent_error = 0;       ///< Expected relative error of irradiance from all other causes, one deviation.
};

struct OptimizedDescriptor {
  RadianceSh rest;
  float step = 0;       ///< By which `rest` may be rounded so that the limit does not feel it; 0: as little as can be.
  IrradianceRms whole;  ///< Of the irradiance of everything.
  IrradianceRms truncation;  ///< Of the irradiance that neither `rest` nor the lights describe.
};

/// Keeps what it chose, so that the next frame does not choose otherwise for nothing. Allocates nothing per frame.
class DescriptorOptimizer {
 public:
  DescriptorOptimizer();

  /// Before choose(): how many lights of a frame are worth finding, `brightest` (null: there is none) among them. Each
  /// costs its bytes, and no more can be saved than the bands above 0 cost with `brightest` or without any. One more
  /// than can pay, and as many as were kept before: two that are alike must not take turns.
  [[nodiscard]] int max_lights_to_find(const Projection& scene, const Light* brightest, const OptimizerOptions& limits);

  /// Takes the lights to keep out of `found` (strongest first) and says what is left. found[must] is kept whatever it
  /// gives; -1: none. Tracks tell which lights were kept before.
  ///
  /// Bands with irradiance are 0, 1, 2, 4 and 6 (A_3 = A_5 = 0): where only irradiance counts no other is sent. With a
  /// limit on radiance all count. Lights are taken in the order in which they help most, for each number of them and
  /// each last band the bytes and the predicted error are worked out, and the cheapest that keeps the limits is taken.
  /// A poorer choice than the last one needs room: a prediction of at most kHysteresis of the limit.
  void optimize(const Projection& scene, std::span<const Light> found, int required, const OptimizerOptions& limits,
              std::vector<Light>& kept, OptimizedDescriptor& out);

 private:
  static constexpr std::size_t kMaxConsidered = 16;
  static constexpr int kBands = kMaxBand + 1;

  struct Shape {
    float y[kRowCount];  ///< Of one unit of vector irradiance.
  };
  struct ResidualSh {
    float c[3][kRowCount];
  };
  struct Configuration {
    std::size_t lights = 0;
    int band = 0;
    double bytes = 0, excess = 0;  ///< `excess`: the largest ratio of a predicted error to its limit.
  };

  /// What an irradiance and a radiance are relative to.
  struct ReferenceRms {
    IrradianceRms irradiance, radiance;
  };

  /// residuals_[0] is the scene.
  [[nodiscard]] ReferenceRms begin(const Projection& scene);
  static void shape_of(const Light& light, Shape& out);
  void subtract(const Light& light, const Shape& shape, ResidualSh& rest) const;
  /// Calls `visit(Option)` for residuals_[lights] and each last band.
  template <class Visit>
  void for_bands(std::size_t lights, const OptimizerOptions& limits, const ReferenceRms& whole, Visit&& visit) const;
  /// What is lost above each band, as squares: [band][channel], irradiance and radiance.
  void truncation_energy(const ResidualSh& rest, bool all_bands, double (&irradiance)[kBands][3],
                  double (&radiance)[kBands][3]) const;
  [[nodiscard]] double residual_energy_above_band2(const ResidualSh& rest, const Light& light, const Shape& shape,
                                      const float (&inverse_whole)[3]) const;
  void order_lights(std::span<const Light> found, int required, std::size_t most, const float (&inverse_whole)[3]);
  [[nodiscard]] bool was_selected(std::uint32_t track) const;

  std::vector<Shape> shapes_;
  std::vector<ResidualSh> residuals_;         ///< After 0, 1, 2, ... lights.
  std::vector<std::size_t> order_;  ///< Indices into `found`.
  std::vector<std::uint32_t> previous_tracks_;
  int previous_band_ = -1;
};

}  // namespace lightwell::estimate
