#include "core/grpc_wire.hpp"

#include <cstring>
#include <optional>

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>
#include <grpcpp/support/slice.h>

#include <lightwell/printable.hpp>

#include "core/mdns_host.hpp"

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
    case grpc::StatusCode::UNAUTHENTICATED:
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

/// gRPC's error message of a failed connection, with an explanation and a remedy.
std::string explained(const std::string& message) {
  const auto says = [&](std::string_view part) { return message.find(part) != std::string::npos; };
  // The messages of OpenSSL, and of gRPC if the SDK's certificate verifier rejects.
  if (says("certificate verify failed") || says("verification check failed"))
    return "the TLS handshake failed: the certificate at this address has expired, was not issued by the trusted "
           "authority, or is not the pinned one; if the probe was given new keys, pair with it "
           "again (" +
           message + ")";
  if (says("DNS resolution failed") && says(".local"))
    return message +
           "; names in .local are those of multicast DNS: is avahi-daemon running on this machine, and the probe on?";
  if (says("andshake failed")) return "the TLS handshake failed (" + message + ")";
  return message;
}

}  // namespace

gpr_timespec deadline_after(Duration from_now) {
  return gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC), gpr_time_from_nanos(from_now.ns, GPR_TIMESPAN));
}

std::shared_ptr<grpc::Channel> new_channel(const std::string& host_port,
                                           const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                                           const std::atomic<bool>* stopping) {
  std::string target = host_port;
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // A probe is on the local network, so the proxy of the environment variables is not used.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // The reader thread controls reconnection.
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  // Limit flow control to about 20 descriptors; the probe then drops old ones. By default gRPC would let the probe send
  // up to 16 MiB ahead of a slow reader: half an hour of old descriptors at 30 per second.
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 4096);
  if (is_mdns_name(host_port))
    if (const std::optional<std::string> address = mdns_address(host_port, stopping)) {
      target = *address;
      arguments.SetSslTargetNameOverride(host_port.substr(0, host_port.rfind(':')));
    }
  return grpc::CreateCustomChannel("dns:///" + target, credentials, arguments);
}

Status status_of(const grpc::Status& status) {
  if (status.ok()) return {};
  return {code_of(status.error_code()), explained(printable(status.error_message()))};
}

std::span<const std::byte> bytes_of(const grpc::ByteBuffer& buffer, std::vector<std::byte>& storage) {
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
