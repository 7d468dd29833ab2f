#include "usb_camera/negotiation.hpp"

#include <algorithm>
#include <utility>

#include "usb_camera/descriptors.hpp"
#include "usb_camera/payload.hpp"

namespace lightwell::usb_camera {

namespace {

constexpr std::uint8_t kProbe = 1, kCommit = 2;
// Of UVC 1.1; 1.0 has the first 26 of them.
constexpr std::size_t kLength = 34, kLengthOfVersion10 = 26;

}  // namespace

Negotiation::Negotiation(SupportedFormats offer, std::uint32_t payload_bytes)
    : offer_(std::move(offer)), payload_bytes_(payload_bytes) {
  initial_.rate = offer_.default_rate;
  reset();
}

void Negotiation::reset() {
  probe_ = committed_ = initial_;
  commit_.reset();
}

Negotiation::Choice Negotiation::nearest(std::span<const std::uint8_t> data) const {
  Choice choice = initial_;
  const std::uint32_t format = get(data, 2, 1), frame = get(data, 3, 1), interval = get(data, 4, 4);
  if (format >= 1 && format <= offer_.encodings.size()) choice.format = static_cast<std::uint8_t>(format);
  if (frame >= 1 && frame <= offer_.sizes.size()) choice.frame = static_cast<std::uint8_t>(frame);
  if (interval > 0) {
    const auto off = [&](int rate) { return std::abs(static_cast<double>(interval_of(rate)) - interval); };
    choice.rate =
        *std::min_element(offer_.rates.begin(), offer_.rates.end(), [&](int a, int b) { return off(a) < off(b); });
  }
  return choice;
}

bool Negotiation::exactly(const Choice& choice, std::span<const std::uint8_t> data) const {
  return get(data, 2, 1) == choice.format && get(data, 3, 1) == choice.frame &&
         get(data, 4, 4) == interval_of(choice.rate);
}

NegotiatedFormat Negotiation::negotiated_format(const Choice& choice) const {
  NegotiatedFormat agreed;
  agreed.format = {offer_.encodings[choice.format - 1U], offer_.sizes[choice.frame - 1U], choice.rate};
  agreed.frame_bytes = static_cast<std::uint32_t>(largest_frame(agreed.format.encoding, agreed.format.size));
  const auto whole = agreed.frame_bytes + static_cast<std::uint32_t>(kPayloadHeader);
  agreed.payload_bytes = payload_bytes_ > 0 ? std::min(payload_bytes_, whole) : whole;
  return agreed;
}

Bytes Negotiation::written(const Choice& choice) const {
  const NegotiatedFormat agreed = negotiated_format(choice);
  Bytes out;
  put(out, 1, 2);  // The interval is what was asked to stay.
  put(out, choice.format, 1);
  put(out, choice.frame, 1);
  put(out, interval_of(choice.rate), 4);
  put(out, 0, 8);  // Key frames, P frames, quality, window: not ours to set.
  put(out, 0, 2);  // Delay.
  put(out, agreed.frame_bytes, 4);
  put(out, agreed.payload_bytes, 4);
  put(out, kClockFrequency, 4);
  put(out, 3, 1);  // Payload headers tell frames apart by FID and end them by EOF.
  put(out, 1, 1);  // Of the format's payload specification, there is one version.
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
      // The least interval is the fastest rate's.
      if (request == ControlRequest::get_min) choice.rate = offer_.rates.front();
      if (request == ControlRequest::get_max) choice.rate = offer_.rates.back();
      return reply(choice);
    }
    case ControlRequest::get_res:
      break;
  }
  return {RequestError::invalid_request, {}};
}

std::optional<NegotiatedFormat> Negotiation::take_commit() { return std::exchange(commit_, std::nullopt); }

}  // namespace lightwell::usb_camera
