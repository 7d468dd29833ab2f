#include "status_message.hpp"

#include "mounting_message.hpp"

namespace lightwell {

void fill_status(const StatusSnapshot& status, v1::InfoResponse& m) {
  m.set_probe_name(status.probe_name);
  m.set_probe_id(status.probe_id);
  m.set_calibration_id(status.calibration_id);
  m.set_version(status.version);
  m.set_camera(status.camera);
  const Counters& from = status.counters;
  v1::Counters& c = *m.mutable_counters();
  c.set_frames(from.frames);
  c.set_captures_dropped(from.captures_dropped);
  c.set_brackets_incomplete(from.brackets_incomplete);
  c.set_estimates(from.estimates);
  c.set_estimates_failed(from.estimates_failed);
  c.set_descriptors_coalesced(from.descriptors_coalesced);
  c.set_clients(from.clients);
  c.set_frames_recorded(from.frames_recorded);
  c.set_recording_faults(from.recording_faults);
  c.set_frames_lost(from.frames_lost);
  c.set_setting_moves(from.setting_moves);
  c.set_estimates_late(from.estimates_late);
  c.set_estimates_late_at_fast(from.estimates_late_at_fast);
  c.set_messages_refused(from.messages_refused);
  c.set_authentication_failures(from.authentication_failures);
  c.set_client_list_faults(from.client_list_faults);
  if (status.T_world_probe) *m.mutable_mounting() = mounting_to(*status.T_world_probe);
}

StatusSnapshot status_of(const v1::InfoResponse& m) {
  StatusSnapshot out;
  out.probe_name = m.probe_name();
  out.probe_id = m.probe_id();
  out.calibration_id = m.calibration_id();
  out.version = m.version();
  out.camera = m.camera();
  const v1::Counters& c = m.counters();
  out.counters = {.frames = c.frames(),
                  .captures_dropped = c.captures_dropped(),
                  .brackets_incomplete = c.brackets_incomplete(),
                  .estimates = c.estimates(),
                  .estimates_failed = c.estimates_failed(),
                  .descriptors_coalesced = c.descriptors_coalesced(),
                  .clients = c.clients(),
                  .frames_recorded = c.frames_recorded(),
                  .recording_faults = c.recording_faults(),
                  .frames_lost = c.frames_lost(),
                  .setting_moves = c.setting_moves(),
                  .estimates_late = c.estimates_late(),
                  .estimates_late_at_fast = c.estimates_late_at_fast(),
                  .messages_refused = c.messages_refused(),
                  .authentication_failures = c.authentication_failures(),
                  .client_list_faults = c.client_list_faults()};
  // An invalid mounting is dropped: queries in world axes then report that the pose is unknown.
  if (m.has_mounting())
    if (const Result<UncertainPose> mounting = mounting_from(m.mounting()); mounting.ok())
      out.T_world_probe = *mounting;
  return out;
}

}  // namespace lightwell
