// Input of the geometric calibration: observations of known points on flat boards.
#pragma once

#include <string>
#include <vector>

#include <lightwell/geometry.hpp>

#include "calibration/model/camera_model.hpp"

namespace lightwell::calibration {

/// A flat board: points in the board frame, m, all with z = 0.
struct Board {
  std::string name;
  std::vector<Vec3d> points;
  /// Number of consecutive points that belong to one tag; 0: unknown. The size of a tag is assumed to be exact, its
  /// position on the board is not.
  int points_per_tag = 0;
};

/// Observation of one board point in a picture.
struct PointObservation {
  int board = 0;  ///< Index into BoardObservations::boards.
  int point = 0;  ///< Index into that board's points.
  PixelPosition pixel;
};

/// A picture of one lens.
struct Picture {
  std::string name;  ///< Used in messages.
  int lens = 0;
  /// Pictures with the same capture index were taken at the same time, except for the lenses' time offset: they share
  /// the rig's pose.
  int capture = 0;
  double time_s = 0;  ///< Of the capture; used to estimate the time offset.
  std::vector<PointObservation> observations;
};

struct LensSize {
  int width = 0, height = 0;
};

struct BoardObservations {
  std::vector<LensSize> lenses;  ///< One or two.
  std::vector<Board> boards;
  std::vector<Picture> pictures;
};

}  // namespace lightwell::calibration
