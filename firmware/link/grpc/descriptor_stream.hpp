// Calls of ProbeService and the set of descriptor streams. Each stream has one write in progress and one slot for the
// newest descriptor.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <vector>

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>

#include "link/link.hpp"

namespace lightwell {

class StreamClients;

/// A call with raw bytes as messages. Deletes itself in OnDone(). gRPC calls the On...() functions from its own
/// threads, never two for the same operation at once.
class ByteCall : public grpc::ServerGenericBidiReactor {
 public:
  explicit ByteCall(StreamClients& streams) : streams_(streams) {}

  /// Sends one message and ends the call.
  void respond(const grpc::ByteBuffer& message);
  /// Ends the call.
  void finish(const grpc::Status& status);
  /// Turns the call into a descriptor stream: it receives every descriptor, or the newest ones if it is slow.
  void subscribe();
  /// Sends a descriptor to a subscribed call, or puts it in the slot while a write is in progress.
  void enqueue(const grpc::ByteBuffer& descriptor);

  void OnWriteDone(bool ok) override;
  void OnCancel() override { finish(grpc::Status::CANCELLED); }
  void OnDone() override;

 private:
  void write(const grpc::ByteBuffer& descriptor);
  void finish_locked(const grpc::Status& status);

  StreamClients& streams_;
  std::mutex mutex_;
  grpc::ByteBuffer current_, next_;
  bool writing_ = false, waiting_ = false, finished_ = false;
};

/// All descriptor streams of one server.
class StreamClients {
 public:
  void publish(const grpc::ByteBuffer& descriptor);
  /// Ends every stream and waits for them, at most 200 ms.
  void close();

  [[nodiscard]] LinkCounters counters() const;

 private:
  friend class ByteCall;
  /// Finishes the call at once if the server is closing.
  void add(ByteCall* client);
  /// Does nothing for a call that was not added.
  void remove(ByteCall* client);

  mutable std::mutex mutex_;
  std::condition_variable removed_;
  std::vector<ByteCall*> clients_;
  bool closing_ = false;
  std::atomic<std::uint64_t> coalesced_{0};
};

}  // namespace lightwell
