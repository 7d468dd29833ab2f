// What an OAK camera's frame says, and what it is made into: times of the probe's clock, words of raw pixels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell::oak {

/// A frame on the host, as depthai delivers it.
struct OakPicture {
  std::shared_ptr<const void> holder;  ///< Whose memory `data` is.
  std::span<const std::byte> data;
  int width = 0, height = 0;
  std::size_t stride = 0;        ///< Bytes from row to row.
  std::size_t plane_stride = 0;  ///< From the first plane to the second.
  std::int64_t timestamp_ns = 0;     ///< End of the first row's exposure, host-synchronised: CLOCK_MONOTONIC on Linux.
  std::int64_t sequence = 0;
  std::uint32_t exposure_us = 0;  ///< In force; 0 where the device does not say.
  std::uint32_t iso = 0;
};

/// Of the centre row. Nothing for a stamp that is none of this host's: in its future, or more than 5 s ago.
[[nodiscard]] std::optional<ProbeTime> mid_exposure(const OakPicture& picture, Duration row_readout, ProbeTime now);

/// MIPI CSI-2 RAW10 (specification v1.3, 11.4.4: four pixels' high bytes, then their low bits) into words of 10 bits,
/// rows packed. data_loss where the picture's rows do not hold `width` pixels, or `words` not the picture.
[[nodiscard]] Status unpack_raw10(const OakPicture& picture, std::span<std::uint16_t> words);

}  // namespace lightwell::oak
