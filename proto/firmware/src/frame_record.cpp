#include <string>

#include <lightwell/frame_record.hpp>

#include "lightwell/v1/recording.pb.h"

namespace lightwell {

void encode_frame_record(const FrameRecord& frame, std::vector<std::byte>& out) {
  // One message per thread, so that its large buffers are reused.
  thread_local v1::FrameRecord m;
  m.Clear();
  m.set_sequence(frame.sequence);
  m.set_mid_exposure_ns(static_cast<std::uint64_t>(frame.mid_exposure.ns));
  m.set_exposure_s(frame.exposure_s);
  m.set_gain(frame.gain);
  m.set_row_readout_ns(static_cast<std::uint64_t>(frame.row_readout.ns));
  m.set_bracket_index(static_cast<std::uint32_t>(frame.bracket_index));
  m.set_bracket_size(static_cast<std::uint32_t>(frame.bracket_size));
  for (const RecordedView& v : frame.views) {
    v1::ViewRecord& view = *m.add_view();
    view.set_lens(static_cast<std::uint32_t>(v.lens));
    view.set_format(std::string(to_string(v.format)));
    view.set_width(static_cast<std::uint32_t>(v.width));
    view.set_height(static_cast<std::uint32_t>(v.height));
    view.set_stride(static_cast<std::uint32_t>(v.stride));
    view.mutable_data()->assign(reinterpret_cast<const char*>(v.data.data()), v.data.size());
  }
  out.resize(m.ByteSizeLong());
  m.SerializeToArray(out.data(), static_cast<int>(out.size()));
}

struct DecodedFrame::State {
  v1::FrameRecord message;
};

Status DecodedFrame::decode(std::span<const std::byte> payload) {
  if (state_ == nullptr) state_ = std::make_shared<State>();
  v1::FrameRecord& m = state_->message;
  frame = {};
  if (!m.ParseFromArray(payload.data(), static_cast<int>(payload.size())))
    return {StatusCode::data_loss, "frame record: not a protobuf message"};
  frame.sequence = m.sequence();
  frame.mid_exposure = {static_cast<std::int64_t>(m.mid_exposure_ns())};
  frame.exposure_s = m.exposure_s();
  frame.gain = m.gain();
  frame.row_readout = {static_cast<std::int64_t>(m.row_readout_ns())};
  frame.bracket_index = static_cast<int>(m.bracket_index());
  frame.bracket_size = static_cast<int>(m.bracket_size());
  if (m.bracket_size() < 1 || m.bracket_size() > 8 || m.bracket_index() >= m.bracket_size())
    return {StatusCode::invalid_argument, "frame record: bracket_index is not below bracket_size"};
  for (const v1::ViewRecord& v : m.view()) {
    const auto format = pixel_format_of(v.format());
    if (!format) return {StatusCode::invalid_argument, "frame record: view.format '" + v.format() + "' is not known"};
    if (v.width() < 1 || v.width() > 16384 || v.height() < 1 || v.height() > 16384)
      return {StatusCode::invalid_argument, "frame record: view.width or height is out of range"};
    frame.views.push_back({static_cast<int>(v.lens()), *format, static_cast<int>(v.width()),
                           static_cast<int>(v.height()), v.stride(), std::as_bytes(std::span(v.data()))});
  }
  if (frame.views.empty() || frame.views.size() > 2)
    return {StatusCode::invalid_argument, "frame record: a frame has one or two views"};
  return {};
}

}  // namespace lightwell
