#include "usb_camera/negotiation.hpp"

#include <algorithm>
#include <utility>

#include "usb_camera/descriptors.hpp"
#include "usb_camera/payload.hpp"

namespace lightwell::usb_camera {

namespace {

constexpr std::uint8_t kProbe = 1, kCommit = 2;
// Length of the probe and commit controls in UVC 1.1; UVC 1.0 has the first 26 bytes.
constexpr std::size_t kLength = 34, kLengthOfVersion10 = 26;

}  // namespace

Negotiation::Negotiation(SupportedFormats formats, std::uint32_t payload_bytes)
    : formats_(std::move(formats)), payload_bytes_(payload_bytes) {
  initial_.rate = formats_.default_rate;
  reset();
}

void Negotiation::reset() {
  probe_ = committed_ = initial_;
  commit_.reset();
}

Negotiation::Choice Negotiation::nearest(std::span<const std::uint8_t> data) const {
  Choice choice = initial_;
  const std::uint32_t format = get(data, 2, 1), frame = get(data, 3, 1), interval = get(data, 4, 4);
  if (format >= 1 && format <= formats_.encodings.size()) choice.format = static_cast<std::uint8_t>(format);
  if (frame >= 1 && frame <= formats_.sizes.size()) choice.frame = static_cast<std::uint8_t>(frame);
  if (interval > 0) {
    const auto off = [&](int rate) { return std::abs(static_cast<double>(interval_of(rate)) - interval); };
    choice.rate =
        *std::min_element(formats_.rates.begin(), formats_.rates.end(), [&](int a, int b) { return off(a) < off(b); });
  }
  return choice;
}

bool Negotiation::exactly(const Choice& choice, std::span<const std::uint8_t> data) const {
  return get(data, 2, 1) == choice.format && get(data, 3, 1) == choice.frame &&
         get(data, 4, 4) == interval_of(choice.rate);
}

NegotiatedFormat Negotiation::negotiated_format(const Choice& choice) const {
  NegotiatedFormat agreed;
  agreed.format = {formats_.encodings[choice.format - 1U], formats_.sizes[choice.frame - 1U], choice.rate};
  agreed.frame_bytes = static_cast<std::uint32_t>(largest_frame(agreed.format.encoding, agreed.format.size));
  const auto whole = agreed.frame_bytes + static_cast<std::uint32_t>(kPayloadHeader);
  agreed.payload_bytes = payload_bytes_ > 0 ? std::min(payload_bytes_, whole) : whole;
  return agreed;
}

Bytes Negotiation::written(const Choice& choice) const {
  const NegotiatedFormat agreed = negotiated_format(choice);
  Bytes out;
  put(out, 1, 2);  // bmHint: the frame interval is to be kept.
  put(out, choice.format, 1);
  put(out, choice.frame, 1);
  put(out, interval_of(choice.rate), 4);
  put(out, 0, 8);  // Key frame rate, P frame rate, quality, window: not supported.
  put(out, 0, 2);  // Delay.
  put(out, agreed.frame_bytes, 4);
  put(out, agreed.payload_bytes, 4);
  put(out, kClockFrequency, 4);
  put(out, 3, 1);  // bmFramingInfo: payload headers have FID and EOF.
  put(out, 1, 1);  // Preferred, minimum and maximum version of the payload format: 1.
  put(out, 1, 1);
  put(out, 1, 1);
  return out;
}

ControlReply Negotiation::request(std::uint8_t selector, ControlRequest request, std::span<const std::uint8_t> data) {
  if (selector != kProbe && selector != kCommit) return {RequestError::invalid_control, {}};
  const bool probe = selector == kProbe;
  const auto reply = [&](const Choice& choice) { return ControlReply{RequestError::none, written(choice)}; };
  switch (request) {
    case ControlRequest::set_cur: {
      if (data.size() != kLength && data.size() != kLengthOfVersion10) return {RequestError::invalid_request, {}};
      const Choice choice = nearest(data);
      if (probe) {
        probe_ = choice;
        return {};
      }
      if (!exactly(choice, data)) return {RequestError::out_of_range, {}};
      committed_ = choice;
      commit_ = negotiated_format(choice);
      return {};
    }
    case ControlRequest::get_cur:
      return reply(probe ? probe_ : committed_);
    case ControlRequest::get_len:
      return {RequestError::none, {kLength, 0}};
    case ControlRequest::get_info:
      return {RequestError::none, {0x03}};
    case ControlRequest::get_min:
    case ControlRequest::get_max:
    case ControlRequest::get_def: {
      if (!probe) break;
      Choice choice = request == ControlRequest::get_def ? initial_ : probe_;
      // The shortest interval belongs to the highest rate.
      if (request == ControlRequest::get_min) choice.rate = formats_.rates.front();
      if (request == ControlRequest::get_max) choice.rate = formats_.rates.back();
      return reply(choice);
    }
    case ControlRequest::get_res:
      break;
  }
  return {RequestError::invalid_request, {}};
}

std::optional<NegotiatedFormat> Negotiation::take_commit() { return std::exchange(commit_, std::nullopt); }

}  // namespace lightwell::usb_camera
