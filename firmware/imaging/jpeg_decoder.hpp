// Decodes JPEG to rgb8 with libjpeg: image files, and successive frames of Motion JPEG without heap allocation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace lightwell {

/// libjpeg only warns of missing and damaged data and fills the picture with grey; here a warning is an error. Bit
/// errors that yield valid codes cannot be detected: JPEG has no checksum. Not thread-safe.
class JpegDecoder {
 public:
  JpegDecoder();
  ~JpegDecoder();

  struct Header {
    int width = 0, height = 0;
    int components = 0;
    bool arithmetic = false;      ///< Arithmetic instead of Huffman codes.
    bool multiple_scans = false;  ///< Progressive, for example: decoding takes memory for the whole picture.
  };
  /// Reads the header of a picture, which must stay valid until decode(). False: see fault().
  [[nodiscard]] bool read_header(std::span<const std::byte> jpeg, Header& header);
  /// After read_header(): writes 3 * width * height bytes. False: see fault(); `rgb` may then be partly written.
  [[nodiscard]] bool decode(std::span<std::byte> rgb);
  /// A frame of Motion JPEG. False unless it is whole, of this size, grey or YCbCr, not progressive, and fits `rgb`.
  [[nodiscard]] bool decode_frame(std::span<const std::byte> jpeg, int width, int height, std::span<std::byte> rgb);
  /// After decode(): the bytes that follow the end marker.
  [[nodiscard]] std::span<const std::byte> rest() const;

  enum class Fault : std::uint8_t {
    cut_off,
    damaged,
    unsupported,  ///< A valid JPEG of a kind that libjpeg does not decode, or too large for it.
  };
  [[nodiscard]] Fault fault() const;
  /// libjpeg's description of the fault.
  [[nodiscard]] const char* message() const;

 private:
  struct Library;
  std::unique_ptr<Library> library_;
};

}  // namespace lightwell
