#include <cstdint>
#include <limits>

#include <lightwell/status_codec.hpp>

#include "lightwell/v1/probe_service.pb.h"
#include "status_message.hpp"

namespace lightwell {
namespace {

constexpr std::size_t kMaxName = 64;
constexpr std::size_t kMaxText = 256;

bool parse(std::span<const std::byte> bytes, v1::InfoResponse& m) {
  return bytes.size() <= std::numeric_limits<int>::max() &&
         m.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

Status wrong(const std::string& what) { return {StatusCode::invalid_argument, "status: " + what}; }

}  // namespace

std::string encode_status(const StatusSnapshot& status) {
  v1::InfoResponse m;
  fill_status(status, m);
  return m.SerializeAsString();
}

Result<StatusSnapshot> decode_status(std::span<const std::byte> bytes) {
  v1::InfoResponse m;
  if (!parse(bytes, m)) return Status(StatusCode::data_loss, "status: not a protobuf message");
  if (m.probe_name().empty() || m.probe_name().size() > kMaxName) return wrong("probe_name must have 1 to 64 bytes");
  if (m.version().size() > kMaxText) return wrong("version is longer than 256 bytes");
  if (m.camera().size() > kMaxText) return wrong("camera is longer than 256 bytes");
  return status_of(m);
}

Result<InfoAnswer> decode_info(std::span<const std::byte> bytes) {
  v1::InfoResponse m;
  if (!parse(bytes, m)) return Status(StatusCode::data_loss, "Info: not a protobuf message");
  return InfoAnswer{status_of(m), {static_cast<std::int64_t>(m.clock_now_ns())}};
}

std::string encode_clock(ProbeTime now) {
  v1::InfoResponse m;
  m.set_clock_now_ns(static_cast<std::uint64_t>(now.ns));
  return m.SerializeAsString();
}

Result<ProbeTime> decode_clock(std::span<const std::byte> bytes) {
  v1::InfoResponse m;
  if (!parse(bytes, m)) return Status(StatusCode::data_loss, "clock: not a protobuf message");
  // Well inside of the range in which differences of times do not overflow.
  constexpr auto kLast = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max() / 4);
  if (m.clock_now_ns() == 0 || m.clock_now_ns() > kLast)
    return Status(StatusCode::data_loss, "clock: clock_now_ns is missing or out of range");
  return ProbeTime{static_cast<std::int64_t>(m.clock_now_ns())};
}

}  // namespace lightwell
