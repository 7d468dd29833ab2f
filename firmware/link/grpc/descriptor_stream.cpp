#include "link/grpc/descriptor_stream.hpp"

#include <algorithm>

namespace lightwell {

void ByteCall::respond(const grpc::ByteBuffer& message) {
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  finished_ = true;
  current_ = message;
  StartWriteAndFinish(&current_, grpc::WriteOptions(), grpc::Status::OK);
}

void ByteCall::finish(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  finish_locked(status);
}

void ByteCall::subscribe() { streams_.add(this); }

void ByteCall::enqueue(const grpc::ByteBuffer& descriptor) {
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  if (writing_) {
    if (waiting_) streams_.coalesced_.fetch_add(1, std::memory_order_relaxed);
    next_ = descriptor;
    waiting_ = true;
    return;
  }
  write(descriptor);
}

void ByteCall::OnWriteDone(bool ok) {
  const std::lock_guard lock(mutex_);
  writing_ = false;
  if (!ok) {
    finish_locked(grpc::Status::CANCELLED);
  } else if (waiting_ && !finished_) {
    waiting_ = false;
    write(next_);
  }
}

void ByteCall::OnDone() {
  streams_.remove(this);
  delete this;
}

void ByteCall::write(const grpc::ByteBuffer& descriptor) {
  current_ = descriptor;
  writing_ = true;
  StartWrite(&current_);
}

void ByteCall::finish_locked(const grpc::Status& status) {
  if (finished_) return;
  finished_ = true;
  Finish(status);
}

void StreamClients::add(ByteCall* client) {
  bool closing = false;
  {
    const std::lock_guard lock(mutex_);
    closing = closing_;
    clients_.push_back(client);
  }
  if (closing) client->finish({grpc::StatusCode::UNAVAILABLE, "the probe is shutting down"});
}

void StreamClients::remove(ByteCall* client) {
  const std::lock_guard lock(mutex_);
  std::erase(clients_, client);
  removed_.notify_all();
}

void StreamClients::publish(const grpc::ByteBuffer& descriptor) {
  const std::lock_guard lock(mutex_);
  for (ByteCall* client : clients_) client->enqueue(descriptor);
}

void StreamClients::close() {
  std::unique_lock lock(mutex_);
  closing_ = true;
  for (ByteCall* client : clients_) client->finish({grpc::StatusCode::UNAVAILABLE, "the probe is shutting down"});
  // The last write of a client that does not read stays pending in gRPC; the deadline of Server::Shutdown() ends it.
  removed_.wait_for(lock, std::chrono::milliseconds(200), [this] { return clients_.empty(); });
}

LinkCounters StreamClients::counters() const {
  const std::lock_guard lock(mutex_);
  return {.clients = static_cast<std::uint32_t>(clients_.size()),
          .coalesced = coalesced_.load(std::memory_order_relaxed)};
}

}  // namespace lightwell
