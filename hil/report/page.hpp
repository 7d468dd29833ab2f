// A page of pictures with captions, as PNG.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/status.hpp>

namespace cv {
class Mat;
}

namespace lightwell::hil {

/// Linear radiance, rows from the top; alpha is the coverage, 0 for the background.
struct LinearPicture {
  int width = 0, height = 0;
  std::vector<Radiance> pixels;
  std::vector<float> alpha;

  LinearPicture() = default;
  LinearPicture(int w, int h)
      : width(w), height(h), pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)), alpha(pixels.size()) {}
  [[nodiscard]] std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
  }
};

/// The part of a picture that starts at (x, y).
[[nodiscard]] LinearPicture cut_out(const LinearPicture& picture, int x, int y, int width, int height);

/// The factor that brings the mean luminance of a picture to a quarter of white, which leaves room for highlights.
[[nodiscard]] double exposure_for(const LinearPicture& picture);

/// Colours are 8-bit sRGB. Positions are pixels from the top left.
class Page {
 public:
  Page(int width, int height);
  ~Page();
  Page(Page&&) noexcept;
  Page& operator=(Page&&) noexcept;

  /// `y` is the baseline.
  void write(const std::string& text, int x, int y, double scale = 0.48);
  /// radiance times `exposure` is 1 for white. `shown_width`: it is scaled to this width; 0: as it is.
  void paste(const LinearPicture& picture, int x, int y, double exposure, int shown_width = 0);
  /// A ring in the colour of marks; with a number beside it unless that is 0.
  void ring(int x, int y, int radius, int number = 0);
  /// Writes PNG. The message of a failure names the file.
  [[nodiscard]] Status save(const std::string& path) const;

 private:
  std::unique_ptr<cv::Mat> pixels_;
};

}  // namespace lightwell::hil
