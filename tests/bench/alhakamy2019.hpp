// Peer: Algorithm 1, "Incident Light Detection", of Alhakamy & Tuceryan, "CubeMap360: Interactive Global Illumination
// for Augmented Reality in Dynamic Environment" (2019), section III.A, implemented with OpenCV on the CPU, from an
// 8-bit frame of the whole sphere.
#pragma once

#include <vector>

#include "bench/equirect_image.hpp"

namespace lightwell::bench {

/// The document gives the steps and their order (blur, threshold to 255, erode, dilate, contours), but no kernel sizes;
/// the usual sizes of this recipe are used.
struct AlhakamyOptions {
  /// "Median of the histogram ... threshold range by the histogram value to 255" is ambiguous.
  enum class Threshold {
    median,  ///< Literally: grey levels at or above the median grey level, which is half of the image.
    midway,  ///< Midway between the median and 255: agrees with "saturated bright areas" and the document's figure 3.
             ///< It is also faster, so timings with it favour the peer.
  };
  Threshold threshold = Threshold::midway;
  int blur_size = 11;   ///< Size of the Gaussian kernel in pixels, odd.
  int erosions = 2;     ///< With 3x3 pixels.
  int dilations = 4;    ///< With 3x3 pixels.
  int main_lights = 8;  ///< "Enable a virtual light in the centre of the main contours": the largest ones.
};

struct AlhakamyLight {
  Triple direction{};    ///< Towards the light, by the mapping of proto/README.md. The document's eq. 2 to 5 are not
                         ///< dimensionally consistent; the equirectangular projection is meant.
  Triple colour{};       ///< Mean over the contour's pixels, 0..255, gamma-encoded as in the frame.
  double area_px = 0;    ///< Inside the contour.
  double intensity = 0;  ///< Luminance of the colour, 0..1.
  double shadow_strength = 0;  ///< intensity / (intensity + mean of the frame): 0.5..1 for lights above the mean.
};

struct AlhakamyResult {
  int median_grey = 0;
  int threshold_grey = 0;
  int contours = 0;                   ///< Number of contours.
  std::vector<AlhakamyLight> lights;  ///< By descending area: the first is the document's main light.
};

/// Uses one thread (OpenCV's threads are disabled during the call). An empty frame gives no lights. Only light
/// detection: cube map and irradiance come from elsewhere in the document.
[[nodiscard]] AlhakamyResult alhakamy_detect(const EquirectFrame& frame, const AlhakamyOptions& options = {});

}  // namespace lightwell::bench
