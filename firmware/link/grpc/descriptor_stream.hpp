// The clients of StreamDescriptors: each has one write under way and one descriptor waiting, the newest.
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <vector>

#include "link/link.hpp"

namespace lightwell {

class StreamClient;

/// All streams of one server. Reactors register themselves; publish() reaches every one.
class StreamClients {
 public:
  /// Owned by gRPC: deletes itself when the call is over. Finishes at once where the server is closing.
  [[nodiscard]] grpc::ServerWriteReactor<grpc::ByteBuffer>* add();

  void publish(const grpc::ByteBuffer& descriptor);
  /// Ends every stream and waits until the last has gone.
  void close();

  [[nodiscard]] LinkCounters counters() const;

 private:
  friend class StreamClient;
  void remove(StreamClient* client);

  mutable std::mutex mutex_;
  std::condition_variable gone_;
  std::vector<StreamClient*> clients_;
  bool closing_ = false;
  std::atomic<std::uint64_t> coalesced_{0};
};

}  // namespace lightwell
