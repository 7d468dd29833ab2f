// Photographs under basis lights in a file, frame by frame, and their relighting while they are read (optional library
// lightwell_relight).
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/relight.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// What a file of photographs holds.
struct BasisFileInfo {
  int columns = 0, rows = 0;  ///< 1 to RelightCamera::kMaxSide.
  std::size_t lights = 0;     ///< 1 to AlphaMaps::kMaxLights.
  std::size_t frames = 0;
};

/// Writes frames to a file. A value takes a byte: the square root of radiance relative to the largest one of its
/// photograph, so that steps grow as the noise of photons does; the error is at most 0.4 % of the largest radiance, 0.2
/// % at a quarter of it.
class BasisWriter {
 public:
  /// Replaces the file. not_found or resource_exhausted where it cannot be written.
  [[nodiscard]] static Result<BasisWriter> create(const std::string& path, int columns, int rows, std::size_t lights);
  /// Values that are negative or not finite become 0. invalid_argument for photographs of other number or size,
  /// resource_exhausted if the disk is full.
  [[nodiscard]] Status add(BasisPictures frame);
  /// Flushes the file. Without it the last frames may be lost.
  [[nodiscard]] Status close();

 private:
  BasisWriter(std::ofstream file, const BasisFileInfo& info) : file_(std::move(file)), info_(info) {}
  std::ofstream file_;
  BasisFileInfo info_;
  std::vector<char> bytes_;
};

/// Relights frames of a file while it reads them: a few rows of all photographs are in memory at a time. One thread.
class BasisReader {
 public:
  /// not_found, or data_loss for a file that is truncated or of another format; sizes are checked before memory is
  /// allocated.
  [[nodiscard]] static Result<BasisReader> open(const std::string& path);
  [[nodiscard]] const BasisFileInfo& info() const { return info_; }

  /// Equation 1 as relight_direct(). Photographs whose alpha and weight are 0 are not read. Allocates nothing.
  /// not_found for a frame that does not exist, invalid_argument for an alpha of another number of lights or pixels,
  /// data_loss where the file ends early.
  [[nodiscard]] Status relight(const AlphaMaps& alpha, std::size_t frame, std::span<Radiance> out);
  /// One photograph. Errors as relight().
  [[nodiscard]] Status read(std::size_t frame, std::size_t light, std::span<Radiance> out);

 private:
  BasisReader(std::ifstream file, const BasisFileInfo& info);
  [[nodiscard]] Status read_scales(std::size_t frame);
  /// Reads a photograph's rows of a band into codes_.
  [[nodiscard]] Status read_codes(std::size_t frame, std::size_t band, std::size_t light);

  std::ifstream file_;
  BasisFileInfo info_;
  std::uint64_t at_ = 0;             ///< Position in the file.
  std::vector<float> scales_;        ///< Largest radiance of each photograph of the frame.
  std::vector<std::uint8_t> codes_;  ///< Of a band of one photograph: three planes.
  std::vector<float> sums_;          ///< Of a band: three planes.
};

}  // namespace lightwell
