// The steps of lightwell-calibrate photometry: from pictures to the photometry of one lens.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/solve/photometry/noise.hpp"
#include "calibration/solve/photometry/picture.hpp"
#include "calibration/solve/photometry/response_solver.hpp"
#include "calibration/solve/photometry/vignetting.hpp"

namespace lightwell::calibrate {

/// Folders and files; a step without input is skipped.
struct PhotometryInputs {
  std::string response, dark, flat, lamp;
  std::string grey;
  photometry::PatchRect patch;
  double grey_exposure_s = 0, grey_gain = 0;  ///< 0: from the frames.csv beside the picture.
  std::optional<std::array<double, 2>> grey_xy;
  std::optional<double> nits, lux;
  double albedo = 0.18;
  double meter_deviation = 0.04;
  int lens = 0;
  int bits = 0;
};

/// The result of each step, and the calibration with all results.
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
  std::vector<std::string> notes;  ///< Remarks on the result for the user.
};

/// Runs the steps in the order of their dependencies: black level, response, dark, flats, lamp, grey card, meter.
/// Values of skipped steps are kept from `rig`. The result has passed RigParameters::validate(). Throws InputError.
[[nodiscard]] PhotometryRun calibrate_photometry(const RigParameters& rig, const PhotometryInputs& inputs);

}  // namespace lightwell::calibrate
