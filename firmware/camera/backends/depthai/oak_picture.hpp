// A frame of an OAK camera, its mid-exposure time in the probe's clock, and unpacking of raw pixels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell::oak {

/// A frame on the host, as delivered by depthai.
struct OakPicture {
  std::shared_ptr<const void> holder;  ///< Owner of the memory of `data`.
  std::span<const std::byte> data;
  int width = 0, height = 0;
  std::size_t stride = 0;         ///< Bytes between the starts of successive rows.
  std::size_t plane_stride = 0;   ///< Bytes from the first plane to the second.
  std::int64_t timestamp_ns = 0;  ///< End of the first row's exposure, synchronised to the host: CLOCK_MONOTONIC.
  std::int64_t sequence = 0;
  std::uint32_t exposure_us = 0;  ///< Exposure of this frame; 0: not reported.
  std::uint32_t iso = 0;
};

/// Middle of the centre row's exposure. Empty for a timestamp of another clock: in the future, or more than 5 s ago.
[[nodiscard]] std::optional<ProbeTime> mid_exposure(const OakPicture& picture, Duration row_readout, ProbeTime now);

/// Unpacks MIPI CSI-2 RAW10 (specification v1.3, 11.4.4: the high bytes of four pixels, then their low bits) into
/// 10-bit values, rows without padding. data_loss if the rows are shorter than `width` pixels, or `words` is too small.
[[nodiscard]] Status unpack_raw10(const OakPicture& picture, std::span<std::uint16_t> words);

}  // namespace lightwell::oak
