// Motion JPEG to rgb8: the whole picture or none.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

namespace lightwell::v4l2 {

/// One picture after the other, of one size, on one thread at a time.
class JpegDecoder {
 public:
  JpegDecoder(int width, int height);
  ~JpegDecoder();

  /// Writes packed rows of rgb8 and says whether that is the whole picture: false for what is no JPEG, has another
  /// size, is cut off, whose coded pixels do not add up, or that is neither YCbCr nor grey. `rgb` is then half written.
  /// Bits that were flipped without breaking the code cannot be found: JPEG has no checksum.
  [[nodiscard]] bool decode(std::span<const std::byte> jpeg, std::span<std::byte> rgb);

 private:
  struct Library;
  std::unique_ptr<Library> library_;
  int width_, height_;
};

}  // namespace lightwell::v4l2
