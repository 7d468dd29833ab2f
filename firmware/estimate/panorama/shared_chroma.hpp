// The possible error by pixels of NV12 and YUYV that share their chroma, anywhere in the picture. (Of lights it is in
// common/error_bound.hpp.)
#pragma once

#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/frames/row_reader.hpp"

namespace lightwell::estimate {

/// Where two colours meet within pixels that share chroma, these have the mean of both colours' chroma with their own
/// luma, and their linear values are not those of the colours. With f the response curve of encoded values, a channel's
/// share a of a chroma sample, and c and l the differences of the colours in chroma and luma, the mean error of such a
/// pixel is up to f'' a² (c/2)² / 2 by the curvature, and f'' a c l / 4 because f' differs between the lumas. Half of
/// the edges fall into such pixels, two wide; summed over neighbouring samples of chroma, squares of their differences
/// are three quarters of c² in the mean. With f'' = 2.6 (a gamma of 2.2) and the RMS of a over the channels, the error
/// of a picture is then 0.7 to 1 times the sum of squares, and up to 1 times the sum of products, of which signs
/// differ: half is counted. Colours that alternate within a sample of chroma have no differences, and their error is
/// not seen.
class SharedChroma {
 public:
  SharedChroma(const RigParameters& rig, const RigTable& table);

  /// Possible error of the integral of luminance over all lenses of the bound bracket; 0 where pixels have their own
  /// colour. Reads one of sixteen rows.
  [[nodiscard]] double error(const RowReader& reader) const;

 private:
  struct Row {
    int y, begin, end;  ///< Pixels that the lens sees; even.
    float sr;           ///< Mean solid angle of a pixel, times the number of rows that this one stands for.
  };
  struct Lens {
    std::vector<Row> rows;
    float largest_white = 1;
  };
  std::vector<Lens> lenses_;
};

}  // namespace lightwell::estimate
