#include <algorithm>
#include <cmath>
#include <limits>

#include <lightwell/status.hpp>
#include <lightwell/text.hpp>

#include "messages.hpp"

namespace lightwell {
namespace {

constexpr std::size_t kMaxName = 64;
constexpr std::size_t kMaxText = 256;
constexpr std::size_t kMaxReportedLinks = 8;

bool parse(std::span<const std::byte> bytes, v1::InfoResponse& m) {
  return bytes.size() <= std::numeric_limits<int>::max() &&
         m.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

Status wrong(const std::string& what) { return invalid_argument("status: " + what); }

/// Calls visit(field, counter) for each field of 64 bits in v1::Counters: all but `clients`.
template <class Visit>
void for_each_counter(Visit visit) {
  using C = Counters;
  int next = 0;
  for (const auto counter : {&C::frames, &C::captures_dropped, &C::brackets_incomplete, &C::estimates,
                             &C::estimates_failed, &C::descriptors_coalesced, &C::frames_recorded, &C::recording_faults,
                             &C::frames_lost, &C::setting_moves, &C::estimates_late, &C::estimates_late_at_fast,
                             &C::messages_refused, &C::authentication_failures, &C::client_list_faults}) {
    if (v1::Counters::descriptor()->field(next)->number() == v1::Counters::kClientsFieldNumber) ++next;
    visit(v1::Counters::descriptor()->field(next++), counter);
  }
}

constexpr int kTriangle = 21;  // Upper triangle of a 6x6 matrix.

Status covariance_problem(const PoseCovariance& c) {
  for (std::size_t r = 0; r < 6; ++r) {
    if (!(c[r][r] >= 0)) return invalid_argument("covariance: variance " + std::to_string(r) + " must not be negative");
    for (std::size_t k = r + 1; k < 6; ++k) {
      const bool known = std::isfinite(c[r][r]) && std::isfinite(c[k][k]);
      // Rounding can make a correlation of 1 slightly larger.
      if (known ? !(c[r][k] * c[r][k] <= c[r][r] * c[k][k] * (1 + 1e-9)) : c[r][k] != 0)
        return invalid_argument("covariance of " + std::to_string(r) + " and " + std::to_string(k) +
                                " is larger than their variances allow; with an infinite variance it must be 0");
    }
  }
  return {};
}

}  // namespace

Pose pose_from(const v1::Pose& m) { return {{m.qx(), m.qy(), m.qz(), m.qw()}, {m.tx(), m.ty(), m.tz()}}; }

void fill_pose(const Pose& pose, v1::Pose& m) {
  const auto& [q, t] = pose;
  m.set_qx(q.x), m.set_qy(q.y), m.set_qz(q.z), m.set_qw(q.w);
  m.set_tx(t.x), m.set_ty(t.y), m.set_tz(t.z);
}

Status pose_problem(const Pose& pose) {
  const auto& [q, t] = pose;
  const double squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  if (!(squared > 1e-18) || !std::isfinite(squared))
    return invalid_argument("pose has no rotation: qx, qy, qz, qw are zero or not finite");
  if (!is_finite(t)) return invalid_argument("pose: tx, ty, tz must be finite");
  return {};
}

Result<UncertainPose> mounting_from(const v1::Mounting& m) {
  UncertainPose out{pose_from(m.pose()), {}};
  if (m.covariance_size() != 0 && m.covariance_size() != kTriangle)
    return invalid_argument("covariance has " + std::to_string(m.covariance_size()) +
                            " numbers; it is 21, the upper triangle row by row, or none");
  int next = 0;
  for (std::size_t r = 0; r < 6 && m.covariance_size() != 0; ++r)
    for (std::size_t k = r; k < 6; ++k) out.covariance[r][k] = out.covariance[k][r] = m.covariance(next++);
  if (const Status s = pose_problem(out.pose); !s.ok()) return s;
  if (const Status s = covariance_problem(out.covariance); !s.ok()) return s;
  out.pose.rotation = out.pose.rotation.normalized();
  return out;
}

v1::Mounting mounting_to(const UncertainPose& T_world_probe) {
  v1::Mounting m;
  fill_pose(T_world_probe.pose, *m.mutable_pose());
  for (std::size_t r = 0; r < 6; ++r)
    for (std::size_t k = r; k < 6; ++k) m.add_covariance(T_world_probe.covariance[r][k]);
  return m;
}

void fill_recording(const RecordingStatus& recording, v1::RecordingStatus& m) {
  m.set_running(recording.running);
  m.set_file(truncated(recording.file, kMaxText));
  m.set_bytes(recording.bytes);
  m.set_descriptors(recording.descriptors);
  m.set_lost(recording.lost);
  m.set_end_reason(truncated(recording.end_reason, kMaxText));
  m.set_faults(recording.faults);
}

RecordingStatus recording_from(const v1::RecordingStatus& m) {
  return {m.running(), m.file(), m.bytes(), m.descriptors(), m.lost(), m.end_reason(), m.faults()};
}

void fill_status(const StatusSnapshot& status, v1::InfoResponse& m) {
  m.set_probe_name(status.probe_name);
  m.set_probe_id(status.probe_id);
  m.set_calibration_id(status.calibration_id);
  m.set_version(status.version);
  m.set_camera(status.camera);
  v1::Counters& counters = *m.mutable_counters();
  counters.set_clients(status.counters.clients);
  for_each_counter([&](const auto* field, auto counter) {
    counters.GetReflection()->SetUInt64(&counters, field, status.counters.*counter);
  });
  if (status.T_world_probe) *m.mutable_mounting() = mounting_to(*status.T_world_probe);
  if (status.temperature_c) m.set_temperature_c(*status.temperature_c);
  for (const LinkStatus& link : std::span(status.links).first(std::min(status.links.size(), kMaxReportedLinks))) {
    v1::LinkStatus& out = *m.add_links();
    out.set_name(truncated(link.name, kMaxName));
    out.set_clients(link.clients);
    out.set_descriptors_coalesced(link.descriptors_coalesced);
    out.set_messages_refused(link.messages_refused);
    out.set_authentication_failures(link.authentication_failures);
    out.set_fault(link.fault);
  }
  if (status.recording) fill_recording(*status.recording, *m.mutable_recording());
}

StatusSnapshot status_of(const v1::InfoResponse& m) {
  StatusSnapshot out;
  out.probe_name = m.probe_name();
  out.probe_id = m.probe_id();
  out.calibration_id = m.calibration_id();
  out.version = m.version();
  out.camera = m.camera();
  out.counters.clients = m.counters().clients();
  for_each_counter([&](const auto* field, auto counter) {
    out.counters.*counter = m.counters().GetReflection()->GetUInt64(m.counters(), field);
  });
  // An invalid mounting is dropped: queries in world axes then report that the pose is unknown.
  if (m.has_mounting())
    if (const Result<UncertainPose> mounting = mounting_from(m.mounting()); mounting.ok())
      out.T_world_probe = *mounting;
  if (m.has_temperature_c()) out.temperature_c = m.temperature_c();
  for (int i = 0; i < std::min(m.links_size(), static_cast<int>(kMaxReportedLinks)); ++i) {
    const v1::LinkStatus& link = m.links(i);
    out.links.push_back({truncated(link.name(), kMaxName), link.clients(), link.descriptors_coalesced(),
                         link.messages_refused(), link.authentication_failures(), link.fault()});
  }
  if (m.has_recording()) out.recording = recording_from(m.recording());
  return out;
}

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
  if (m.recording().file().size() > kMaxText) return wrong("recording.file is longer than 256 bytes");
  if (m.recording().end_reason().size() > kMaxText) return wrong("recording.end_reason is longer than 256 bytes");
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
