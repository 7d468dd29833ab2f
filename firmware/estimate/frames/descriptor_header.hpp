// The header fields of a descriptor, common to all estimators.
#pragma once

#include <cstdint>
#include <span>

#include <lightwell/descriptor.hpp>

#include "imaging/frame.hpp"

namespace lightwell::estimate {

struct DescriptorHeader {
  Units units = Units::relative;
  std::uint32_t probe_id = 0, calibration_id = 0;
  Setting setting = Setting::balanced;
};

/// Sets sequence, times, units, identities and setting of `out`. The sequence counts captures; a bracket is one
/// capture, so that descriptors of brackets are numbered without gaps. The time is the middle between the first and the
/// last mid-exposure. The time of encoding is not known yet; it is set to that of delivery.
inline void fill_header(std::span<const Frame> bracket, const DescriptorHeader& header, Descriptor& out) {
  const FrameInfo &first = bracket.front().info, &last = bracket.back().info;
  out.sequence = first.sequence / bracket.size();
  out.time.mid_exposure = first.mid_exposure + Duration{(last.mid_exposure - first.mid_exposure).ns / 2};
  out.time.delivered_after = last.delivered - out.time.mid_exposure;
  out.time.encoded_after = out.time.delivered_after;
  out.units = header.units;
  out.probe_id = header.probe_id;
  out.calibration_id = header.calibration_id;
  out.setting = header.setting;
}

}  // namespace lightwell::estimate
