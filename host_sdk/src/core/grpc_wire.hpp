// What gRPC and this SDK say to each other: deadlines, codes, channels, identities.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <grpc/support/time.h>
#include <grpcpp/channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/status.h>

#include <lightwell/probe.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell::core {

/// By the monotonic clock: a wall clock that jumps changes nothing.
[[nodiscard]] gpr_timespec deadline_after(Duration from_now);

/// One new TCP connection, whatever channels there were before: a dead connection is not found
/// again. A name in .local is asked for by multicast DNS, which takes a second at most and ends early once `*stopping`;
/// where nobody answers to that, DNS is asked as for any name. Certificates are judged by the name.
[[nodiscard]] std::shared_ptr<grpc::Channel> new_channel(const std::string& host_port,
                                                         const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                                                         const std::atomic<bool>* stopping = nullptr);

/// The code that lies nearest, and gRPC's message.
[[nodiscard]] Status status_of(const grpc::Status& status);

/// The bytes of a message, in one piece, in `storage` whose memory is used again.
[[nodiscard]] std::span<const std::byte> bytes_of(const grpc::ByteBuffer& buffer, std::vector<std::byte>& storage);

}  // namespace lightwell::core
