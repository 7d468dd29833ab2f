// Decodes Motion JPEG frames to rgb8; incomplete pictures are refused.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

namespace lightwell::v4l2 {

/// Decodes successive pictures of one size. Not thread-safe.
class JpegDecoder {
 public:
  JpegDecoder(int width, int height);
  ~JpegDecoder();

  /// Writes rows of rgb8 without padding. False if the data are not a JPEG, have another size, are truncated or
  /// corrupt, or are neither YCbCr nor grey; `rgb` may then be partly written. Bit errors that yield valid codes cannot
  /// be detected: JPEG has no checksum.
  [[nodiscard]] bool decode(std::span<const std::byte> jpeg, std::span<std::byte> rgb);

 private:
  struct Library;
  std::unique_ptr<Library> library_;
  int width_, height_;
};

}  // namespace lightwell::v4l2
