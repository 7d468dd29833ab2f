#include "link/grpc/descriptor_stream.hpp"

#include <algorithm>

namespace lightwell {

/// One client's stream. gRPC calls On...() from its own threads, never two for the same write at once.
class StreamClient final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  explicit StreamClient(StreamClients& all) : all_(all) {}

  void offer(const grpc::ByteBuffer& descriptor) {
    const std::lock_guard lock(mutex_);
    if (finished_) return;
    if (writing_) {
      if (waiting_) all_.coalesced_.fetch_add(1, std::memory_order_relaxed);
      next_ = descriptor;
      waiting_ = true;
      return;
    }
    write(descriptor);
  }

  void finish(const grpc::Status& status) {
    const std::lock_guard lock(mutex_);
    finish_locked(status);
  }

  void OnWriteDone(bool ok) override {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    if (!ok) {
      finish_locked(grpc::Status::CANCELLED);
    } else if (waiting_ && !finished_) {
      waiting_ = false;
      write(next_);
    }
  }

  void OnCancel() override { finish(grpc::Status::CANCELLED); }

  void OnDone() override {
    all_.remove(this);
    delete this;
  }

 private:
  void write(const grpc::ByteBuffer& descriptor) {
    current_ = descriptor;
    writing_ = true;
    StartWrite(&current_);
  }
  void finish_locked(const grpc::Status& status) {
    if (finished_) return;
    finished_ = true;
    Finish(status);
  }

  StreamClients& all_;
  std::mutex mutex_;
  grpc::ByteBuffer current_, next_;
  bool writing_ = false, waiting_ = false, finished_ = false;
};

grpc::ServerWriteReactor<grpc::ByteBuffer>* StreamClients::add() {
  auto* client = new StreamClient(*this);
  bool closing = false;
  {
    const std::lock_guard lock(mutex_);
    closing = closing_;
    clients_.push_back(client);
  }
  if (closing) client->finish({grpc::StatusCode::UNAVAILABLE, "the probe is shutting down"});
  return client;
}

void StreamClients::remove(StreamClient* client) {
  const std::lock_guard lock(mutex_);
  std::erase(clients_, client);
  gone_.notify_all();
}

void StreamClients::publish(const grpc::ByteBuffer& descriptor) {
  const std::lock_guard lock(mutex_);
  for (StreamClient* client : clients_) client->offer(descriptor);
}

void StreamClients::close() {
  std::unique_lock lock(mutex_);
  closing_ = true;
  for (StreamClient* client : clients_) client->finish({grpc::StatusCode::UNAVAILABLE, "the probe is shutting down"});
  // A client that does not read keeps its last write in gRPC's hands; the server's own deadline ends it.
  gone_.wait_for(lock, std::chrono::milliseconds(200), [this] { return clients_.empty(); });
}

LinkCounters StreamClients::counters() const {
  const std::lock_guard lock(mutex_);
  return {static_cast<std::uint32_t>(clients_.size()), coalesced_.load(std::memory_order_relaxed)};
}

}  // namespace lightwell
