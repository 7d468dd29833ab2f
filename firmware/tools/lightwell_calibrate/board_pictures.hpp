// Reads pictures of boards from folders and detects their tags.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/solve/geometry/board_observations.hpp"
#include "pose/tag_board.hpp"

namespace lightwell::calibrate {

struct BoardPictures {
  /// Files and folders, one list per lens; that of lens 1 may be empty.
  std::array<std::vector<std::string>, 2> lenses;
  std::vector<std::string> boards;  ///< Kalibr's YAML.
  /// Photometry by lens, for its response; without it, pictures are read as sRGB. With a wrong response every tag
  /// appears a third of a pixel smaller on each side, because a blurred edge is symmetric only in linear intensity.
  std::vector<PhotometricCalibration> photometry;
  double rate_hz = 0;  ///< Pictures per second, if they were taken at a constant rate; 0: unknown times.
};

/// Called after each picture with the number of processed pictures and the total.
using Progress = std::function<void(std::size_t, std::size_t)>;

/// Observations without rectified views, and approximate lenses.
struct FirstPass {
  calibration::BoardObservations seen;
  std::vector<LensParameters> lenses;
  std::vector<bool> rectify;  ///< By lens, whether rectified views can find more tags.
};

/// Pictures with the same file name (without extension) in the folders of a pair's lenses belong to one capture. With
/// `before`, tags are also searched in rectified views, except in pictures that already had every point of every board.
/// Throws InputError, which names the file: pictures of a lens with different sizes, boards with common tag ids.
[[nodiscard]] calibration::BoardObservations read_board_observations(const BoardPictures& in, const FirstPass* before,
                                                                     const Progress& progress);

}  // namespace lightwell::calibrate
