// Pictures of boards in folders: found, read, their tags looked for.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/geometry/board_observations.hpp"
#include "pose/tag_board.hpp"

namespace lightwell::calibrate {

struct BoardPictures {
  /// Files and folders, a list for each lens.
  std::vector<std::vector<std::string>> lenses;
  std::vector<std::string> boards;  ///< Kalibr's YAML.
  /// By lens, what picture values mean; where it is not given, pictures are sRGB. A blurred edge is half way between
  /// black and white in light, not in values: told wrong, every tag looks a third of a pixel smaller all around.
  std::vector<PhotometricCalibration> photometry;
  double rate_hz =
      0;  ///< Pictures a second, where they were taken one after another; 0: nothing is known of their times.
};

/// Called after each picture: how many of how many.
using Progress = std::function<void(std::size_t, std::size_t)>;

/// What pictures showed without rectified views, and the lenses about as they are.
struct FirstPass {
  calibration::BoardObservations seen;
  std::vector<LensParameters> lenses;
  std::vector<bool> rectify;  ///< By lens, whether rectified views can show more.
};

/// Pictures of the same name, but for the folder, are of one capture; so the pictures of a pair's lenses find each
/// other. `before`, where given: tags at the edge of the picture are looked for in rectified views, in pictures that
/// did not show every point of every board at once. Errors name the file: pictures of another size than the first
/// one's, boards that share numbers.
[[nodiscard]] Result<calibration::BoardObservations> read_board_observations(const BoardPictures& in, const FirstPass* before,
                                                            const Progress& progress);

}  // namespace lightwell::calibrate
