// The records of a recording of frames: a camera's frame with its metadata, encoded and decoded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

/// One lens's picture inside a FrameRecord.
struct RecordedView {
  int lens = 0;
  PixelFormat format = PixelFormat::rgb8;
  int width = 0, height = 0;
  std::size_t stride = 0;
  std::span<const std::byte> data;
};

struct FrameRecord {
  std::uint64_t sequence = 0;
  ProbeTime mid_exposure;
  double exposure_s = 0, gain = 1;
  Duration row_readout;
  int bracket_index = 0, bracket_size = 1;
  std::vector<RecordedView> views;
};

/// Encodes into `out`, whose memory is reused.
void encode_frame_record(const FrameRecord& frame, std::vector<std::byte>& out);

/// A decoded frame; the data of `frame.views` point into memory of this object.
class DecodedFrame {
 public:
  DecodedFrame() = default;
  DecodedFrame(DecodedFrame&&) = default;
  DecodedFrame& operator=(DecodedFrame&&) = default;
  /// data_loss, or invalid_argument with the name of the field. Does not compare the bytes of a view with its size and
  /// stride: a reader must do that.
  [[nodiscard]] Status decode(std::span<const std::byte> payload);
  FrameRecord frame;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace lightwell
