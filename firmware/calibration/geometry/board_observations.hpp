// What geometry is calibrated from: where known points of flat boards were seen, as plain values.
#pragma once

#include <string>
#include <vector>

#include <lightwell/geometry.hpp>

#include "calibration/camera_model.hpp"

namespace lightwell::calibration {

/// A flat board: points that are known in its own frame, m, all with z = 0.
struct Board {
  std::string name;
  std::vector<Vec3d> points;
  /// So many points that follow each other are of one tag, whose size is right where its place is not; 0: not known.
  int points_per_tag = 0;
};

/// One point of a board in a picture.
struct PointObservation {
  int board = 0;  ///< Index into BoardObservations::boards.
  int point = 0;  ///< Index into that board's points.
  PixelPosition pixel;
};

/// One lens's picture.
struct Picture {
  std::string name;  ///< For messages.
  int lens = 0;
  /// Pictures of one capture were taken at the same time but for the lenses' time offset: they share the rig's pose.
  int capture = 0;
  double time_s = 0;  ///< Of the capture; used where a time offset is asked for.
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
