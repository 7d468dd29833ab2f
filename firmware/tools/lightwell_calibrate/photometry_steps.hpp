// The steps of lightwell-calibrate photometry: pictures in, one lens's photometry mended.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/photometry/absolute_scale.hpp"
#include "calibration/photometry/dark.hpp"
#include "calibration/photometry/noise.hpp"
#include "calibration/photometry/patch.hpp"
#include "calibration/photometry/response_solver.hpp"
#include "calibration/photometry/vignetting_solver.hpp"
#include "calibration/photometry/white_balance.hpp"

namespace lightwell::calibrate {

/// Folders and files; an empty one leaves its step out.
struct PhotometryInputs {
  std::string response, dark, flat, lamp;
  std::string grey;
  photometry::PatchRect patch;
  double grey_exposure_s = 0, grey_gain = 0;  ///< 0: as the frames.csv beside the picture says.
  std::optional<std::array<double, 2>> grey_xy;
  std::optional<double> nits, lux;
  double albedo = 0.18;
  double meter_deviation = 0.04;
  int lens = 0;
  int bits = 0;
};

/// What was found, a step each, and the calibration that holds it.
struct PhotometryRun {
  RigParameters rig;
  int lens = 0;
  std::optional<photometry::ResponseEstimate> response;
  std::optional<photometry::DarkEstimate> dark;
  std::vector<photometry::NoiseLevel> levels;
  std::optional<photometry::NoiseEstimate> noise;
  std::vector<photometry::LampObservation> observations;
  std::optional<photometry::VignettingEstimate> vignetting;
  std::optional<photometry::WhiteBalance> white_balance;
  std::optional<photometry::AbsoluteScale> scale;
  std::vector<std::string> notes;  ///< What a person should know of the result.
};

/// In the order in which one needs the other: dark value, response, dark, flats, lamp, grey card, meter. What is not
/// given stays as in `rig`. The result has passed RigParameters::validate().
[[nodiscard]] Result<PhotometryRun> calibrate_photometry(const RigParameters& rig, const PhotometryInputs& inputs);

}  // namespace lightwell::calibrate
