// Lights and the rest: takes caps out of a projection, keeps the bands that are wanted, and says what is lost.
#pragma once

#include <lightwell/descriptor.hpp>
#include <span>

#include "estimate/common/cells.hpp"

namespace lightwell::estimate {

/// An RMS over all normals, both ways that errors are counted: over three channels alike, and by luminance weight.
struct IrradianceRms {
  double plain = 0;     ///< Root of the mean over normals and channels.
  double weighted = 0;  ///< Root of the mean over normals of the weighted sum of squares.
};

/// The larger of the two relative errors; 0 for 0/0, infinite where there is an error but no light.
[[nodiscard]] double relative(const IrradianceRms& error, const IrradianceRms& whole);

/// Of the irradiance that bands 0 to 12 of a projection make.
[[nodiscard]] IrradianceRms irradiance_rms(const Projection& scene);

struct Decomposition {
  RadianceSh rest;            ///< Radiance without the lights, up to the band asked for.
  IrradianceRms whole;        ///< Of the irradiance of everything.
  IrradianceRms truncation;   ///< Of the irradiance that neither `rest` nor the lights describe.
};

/// The mean-square irradiance error of stopping at a band is (1/4pi) sum over l > band of A_l² |c_lm|² (Parseval). The
/// caps are exact at every receiver, so c_lm is the light of the scene less that of the caps: what a cap misses of its
/// lamp counts too. Seen are bands to 6 and 8, 10, 12; what lies above is taken to be as strong, relative to those, as
/// for a point of light, which has the flattest spectrum.
[[nodiscard]] Decomposition decompose(const Projection& scene, std::span<const Light> lights, int band);

}  // namespace lightwell::estimate
