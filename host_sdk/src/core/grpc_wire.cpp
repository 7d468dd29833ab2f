#include "core/grpc_wire.hpp"

#include <cstring>

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>
#include <grpcpp/support/slice.h>

namespace lightwell::core {
namespace {

StatusCode code_of(grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::OK:
      return StatusCode::ok;
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::OUT_OF_RANGE:
    case grpc::StatusCode::UNIMPLEMENTED:
      return StatusCode::invalid_argument;
    case grpc::StatusCode::NOT_FOUND:
      return StatusCode::not_found;
    case grpc::StatusCode::DATA_LOSS:
      return StatusCode::data_loss;
    case grpc::StatusCode::FAILED_PRECONDITION:
      return StatusCode::failed_precondition;
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::CANCELLED:
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return StatusCode::unavailable;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return StatusCode::resource_exhausted;
    default:
      return StatusCode::internal;
  }
}

}  // namespace

gpr_timespec deadline_after(Duration from_now) {
  return gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC), gpr_time_from_nanos(from_now.ns, GPR_TIMESPAN));
}

std::shared_ptr<grpc::Channel> new_channel(const std::string& host_port) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // A probe stands in the same room, never behind the proxy that the environment names.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // The reader thread decides when to try again.
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  // gRPC would let the probe send up to 16 MiB ahead of a reader that is slow: half an hour of old light at 30
  // descriptors a second. About 20 descriptors are allowed; the probe then leaves out what is old.
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 4096);
  return grpc::CreateCustomChannel("dns:///" + host_port, grpc::InsecureChannelCredentials(),
                                   arguments);
}

Status status_of(const grpc::Status& status) {
  if (status.ok()) return {};
  return {code_of(status.error_code()), status.error_message()};
}

ProbeInfo info_of(const v1::InfoResponse& response) {
  ProbeInfo info;
  info.name = response.probe_name();
  info.id = response.probe_id();
  info.calibration_id = response.calibration_id();
  info.version = response.version();
  info.camera = response.camera();
  const v1::Counters& counters = response.counters();
  info.counters = {.frames = counters.frames(),
                   .captures_dropped = counters.captures_dropped(),
                   .brackets_incomplete = counters.brackets_incomplete(),
                   .estimates = counters.estimates(),
                   .estimates_failed = counters.estimates_failed(),
                   .descriptors_coalesced = counters.descriptors_coalesced(),
                   .clients = counters.clients(),
                   .frames_recorded = counters.frames_recorded(),
                   .recording_faults = counters.recording_faults(),
                   .frames_lost = counters.frames_lost(),
                   .setting_moves = counters.setting_moves(),
                   .estimates_late = counters.estimates_late(),
                   .estimates_late_at_fast = counters.estimates_late_at_fast()};
  return info;
}

std::span<const std::byte> bytes_of(const grpc::ByteBuffer& buffer,
                                    std::vector<std::byte>& storage) {
  storage.clear();
  std::vector<grpc::Slice> slices;
  if (!buffer.Dump(&slices).ok()) return {};
  for (const grpc::Slice& slice : slices) {
    const std::size_t end = storage.size();
    storage.resize(end + slice.size());
    if (slice.size() > 0) std::memcpy(storage.data() + end, slice.begin(), slice.size());
  }
  return storage;
}

}  // namespace lightwell::core
