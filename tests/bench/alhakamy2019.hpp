// Peer: Algorithm 1, "Incident Light Detection", of Alhakamy & Tuceryan, "CubeMap360: Interactive Global
// Illumination for Augmented Reality in Dynamic Environment" (2019), section III.A, in OpenCV on the
// processor, from an 8-bit frame of the whole sphere.
#pragma once

#include <vector>

#include "bench/equirect_image.hpp"

namespace lightwell::bench {

/// The document names the steps and the order, and no size of a kernel: those here are of the recipe whose
/// steps they are (blur, threshold to 255, erode, dilate, contours), with its usual sizes.
struct AlhakamyOptions {
  /// "Median of the histogram ... threshold range by the histogram value to 255" can be read in two ways.
  enum class Threshold {
    median,  ///< To the letter: grey levels at and above the median grey level, which is half of the picture.
    midway,  ///< Midway from the median to 255: what "saturated bright areas" and the document's figure 3 want. The
             ///< quicker of the two as well: a comparison of time with it favours the peer.
  };
  Threshold threshold = Threshold::midway;
  int blur_size = 11;   ///< Of the Gaussian, odd, in pixels.
  int erosions = 2;     ///< With 3x3 pixels.
  int dilations = 4;    ///< With 3x3 pixels.
  int main_lights = 8;  ///< "Enable a virtual light in the centre of the main contours": the largest ones.
};

struct AlhakamyLight {
  Triple direction{};          ///< Towards the light, in the house's mapping; the document's eq. 2 to 5 are not
                               ///< dimensionally sound, and mean the equirectangular projection.
  Triple colour{};             ///< Mean over the contour's pixels, 0..255, gamma-encoded as in the frame.
  double area_px = 0;          ///< Inside the contour.
  double intensity = 0;        ///< Luminance of the colour, 0..1.
  double shadow_strength = 0;  ///< Intensity by itself and the frame's mean: 0.5..1 for lights brighter than that.
};

struct AlhakamyResult {
  int median_grey = 0;
  int threshold_grey = 0;
  int contours = 0;             ///< How many there were.
  std::vector<AlhakamyLight> lights;  ///< By descending area: the first is the document's main light.
};

/// One thread (OpenCV's own are switched off for the call); a frame with less than a pixel gives no lights.
/// Light detection alone: neither cube map nor irradiance, which the document has from elsewhere.
[[nodiscard]] AlhakamyResult alhakamy_detect(const EquirectFrame& frame, const AlhakamyOptions& options = {});

}  // namespace lightwell::bench
