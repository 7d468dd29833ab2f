// One call, and those of them that are streams of descriptors: each has one write under way and one descriptor waiting,
// the newest.
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

/// A call of which gRPC hands over the bytes. Deletes itself when it is over. gRPC calls On...() from its own threads,
/// never two for the same operation at once.
class ByteCall : public grpc::ServerGenericBidiReactor {
 public:
  explicit ByteCall(StreamClients& all) : all_(all) {}

  /// One message and the end.
  void answer(const grpc::ByteBuffer& message);
  void finish(const grpc::Status& status);
  /// From now on it gets every descriptor, or the newest where it is slow.
  void subscribe();
  /// A descriptor for a call that follows.
  void enqueue(const grpc::ByteBuffer& descriptor);

  void OnWriteDone(bool ok) override;
  void OnCancel() override { finish(grpc::Status::CANCELLED); }
  void OnDone() override;

 private:
  void write(const grpc::ByteBuffer& descriptor);
  void finish_locked(const grpc::Status& status);

  StreamClients& all_;
  std::mutex mutex_;
  grpc::ByteBuffer current_, next_;
  bool writing_ = false, waiting_ = false, finished_ = false;
};

/// All streams of one server. publish() reaches every one.
class StreamClients {
 public:
  void publish(const grpc::ByteBuffer& descriptor);
  /// Ends every stream and waits until the last has gone.
  void close();

  [[nodiscard]] LinkCounters counters() const;

 private:
  friend class ByteCall;
  /// Finishes it at once where the server is closing.
  void add(ByteCall* client);
  /// Nothing where it is not there.
  void remove(ByteCall* client);

  mutable std::mutex mutex_;
  std::condition_variable gone_;
  std::vector<ByteCall*> clients_;
  bool closing_ = false;
  std::atomic<std::uint64_t> coalesced_{0};
};

}  // namespace lightwell
