#include "usb_camera/controls.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lightwell::usb_camera {
namespace {

// Indices into the table below.
constexpr std::size_t kMode = 0, kExposure = 1, kGain = 2, kWhite = 3, kAutoWhite = 4, kPowerLine = 5;

constexpr std::uint32_t kManual = 1, kAperturePriority = 8;
constexpr double kExposuresPerSecond = 10'000, kGainCodes = 100;

struct Spec {
  std::uint8_t unit, selector;
  int bit;  ///< In bmControls.
  std::uint8_t length;
  std::uint32_t min, max, res, initial;
  bool bitmap = false;  ///< `res` is the bit mask of the values, and there is no minimum and maximum.
};

constexpr std::array<Spec, 6> kSpecs = {{
    {kCameraTerminal, 0x02, 1, 1, 0, 0, kManual | kAperturePriority, kAperturePriority, true},
    {kCameraTerminal, 0x04, 3, 4, 1, 10'000, 1, 100},
    {kProcessingUnit, 0x04, 9, 2, 100, 400, 1, 100},
    {kProcessingUnit, 0x0A, 6, 2, 2800, 8000, 10, kNeutralKelvin},
    {kProcessingUnit, 0x0B, 12, 1, 0, 1, 1, 1},
    {kProcessingUnit, 0x05, 10, 1, 0, 2, 1, 0},
}};

std::optional<std::size_t> find(std::uint8_t unit, std::uint8_t selector) {
  for (std::size_t i = 0; i < kSpecs.size(); ++i)
    if (kSpecs[i].unit == unit && kSpecs[i].selector == selector) return i;
  return std::nullopt;
}

ControlReply number(std::uint32_t value, std::size_t bytes) {
  ControlReply reply;
  put(reply.data, value, bytes);
  return reply;
}

bool allowed(const Spec& spec, std::uint32_t value) {
  // Exactly one of the modes can be active.
  if (spec.bitmap) return (value & spec.res) == value && value != 0 && (value & (value - 1)) == 0;
  return value >= spec.min && value <= spec.max && (value - spec.min) % spec.res == 0;
}

constexpr std::uint8_t kProbe = 1, kCommit = 2;
// Length of the probe and commit controls in UVC 1.1; UVC 1.0 has the first 26 bytes.
constexpr std::size_t kLength = 34, kLengthOfVersion10 = 26;

}  // namespace

std::uint32_t control_bitmap(std::uint8_t unit) {
  std::uint32_t bits = 0;
  for (const Spec& spec : kSpecs)
    if (spec.unit == unit) bits |= 1U << spec.bit;
  return bits;
}

Controls::Controls() { reset(); }

void Controls::reset() {
  for (std::size_t i = 0; i < kSpecs.size(); ++i) values_[i] = kSpecs[i].initial;
}

void Controls::set_automatic(double exposure_s, double longest_s) {
  automatic_s_ = exposure_s;
  longest_s_ = longest_s;
}

bool Controls::automatic(std::size_t control) const {
  if (control == kExposure) return values_[kMode] != kManual;
  return control == kWhite && values_[kAutoWhite] != 0;
}

double Controls::automatic_exposure_s() const {
  double exposure = std::min(automatic_s_ / (values_[kGain] / kGainCodes), longest_s_);
  if (values_[kPowerLine] != 0) {
    // Lamps flicker at twice the mains frequency. An exposure of whole flicker periods is not affected; a shorter one
    // is.
    const double flicker_hz = values_[kPowerLine] == 1 ? 100 : 120;
    const double periods = std::floor(exposure * flicker_hz);
    if (periods >= 1) exposure = periods / flicker_hz;
  }
  return exposure;
}

std::uint32_t Controls::current(std::size_t control) const {
  const Spec& spec = kSpecs[control];
  if (!automatic(control)) return values_[control];
  if (control == kWhite) return kNeutralKelvin;
  const double codes = std::round(automatic_exposure_s() * kExposuresPerSecond);
  return static_cast<std::uint32_t>(std::clamp<double>(codes, spec.min, spec.max));
}

RequestError Controls::set(std::size_t control, std::span<const std::uint8_t> data) {
  const Spec& spec = kSpecs[control];
  if (data.size() != spec.length) return RequestError::invalid_request;
  if (automatic(control)) return RequestError::wrong_state;
  const std::uint32_t value = get(data, 0, spec.length);
  if (!allowed(spec, value)) return RequestError::out_of_range;
  // Leaving automatic mode keeps the automatically chosen value.
  if (control == kMode && value == kManual) values_[kExposure] = current(kExposure);
  if (control == kAutoWhite && value == 0) values_[kWhite] = current(kWhite);
  values_[control] = value;
  ++sets_;
  return RequestError::none;
}

ControlReply Controls::request(std::uint8_t unit, std::uint8_t selector, ControlRequest request,
                               std::span<const std::uint8_t> data) {
  if (control_bitmap(unit) == 0) return {RequestError::invalid_unit, {}};
  const std::optional<std::size_t> found = find(unit, selector);
  if (!found) return {RequestError::invalid_control, {}};
  const Spec& spec = kSpecs[*found];
  switch (request) {
    case ControlRequest::set_cur:
      return {set(*found, data), {}};
    case ControlRequest::get_cur:
      return number(current(*found), spec.length);
    case ControlRequest::get_min:
    case ControlRequest::get_max:
      if (spec.bitmap) break;
      return number(request == ControlRequest::get_min ? spec.min : spec.max, spec.length);
    case ControlRequest::get_res:
      return number(spec.res, spec.length);
    case ControlRequest::get_def:
      return number(spec.initial, spec.length);
    case ControlRequest::get_len:
      return number(spec.length, 2);
    case ControlRequest::get_info: {
      // Table 4-3: get and set supported; controls with an automatic mode have autoupdate, and are disabled in that
      // mode.
      const bool autoupdate = *found == kExposure || *found == kWhite;
      return number(0x03U | (autoupdate ? 0x08U : 0U) | (automatic(*found) ? 0x04U : 0U), 1);
    }
  }
  return {RequestError::invalid_request, {}};
}

SensorSettings Controls::settings() const {
  SensorSettings settings;
  // The quotient is the double nearest to the decimal number, the same value that parsing "0.3ms" gives.
  settings.exposure_s = automatic(kExposure) ? automatic_exposure_s() : values_[kExposure] / kExposuresPerSecond;
  settings.gain = values_[kGain] / kGainCodes;
  settings.kelvin = static_cast<int>(current(kWhite));
  return settings;
}

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
