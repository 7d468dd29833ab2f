#include "link/grpc/probe_service.hpp"

#include <string_view>
#include <utility>

#include "link/grpc/transport.hpp"

namespace lightwell {
namespace {

/// An :authority that no client sends, because no host can have a name in .invalid (RFC 6761).
constexpr const char* kNoHost = "lightwell.invalid";

grpc::Status shutting_down() { return {grpc::StatusCode::UNAVAILABLE, "the probe is shutting down"}; }

}  // namespace

/// A call with raw bytes as messages. Reads its one request and passes it to the handler of its method. Deletes itself
/// in OnDone(). gRPC calls the On...() functions from its own threads, never two for the same operation at once.
class ProbeService::Call final : public grpc::ServerGenericBidiReactor {
 public:
  Call(ProbeService& service, Method method) : service_(service), method_(method) { StartRead(&request_); }

  /// Sends one message and ends the call.
  void respond(const grpc::ByteBuffer& message) {
    const std::lock_guard lock(mutex_);
    if (finished_) return;
    finished_ = true;
    current_ = message;
    StartWriteAndFinish(&current_, grpc::WriteOptions(), grpc::Status::OK);
  }

  /// Ends the call.
  void finish(const grpc::Status& status) {
    const std::lock_guard lock(mutex_);
    finish_locked(status);
  }

  /// Sends a descriptor, or puts it in the slot while a write is in progress.
  void enqueue(const grpc::ByteBuffer& descriptor) {
    const std::lock_guard lock(mutex_);
    if (finished_) return;
    if (!writing_) return write(descriptor);
    if (waiting_) service_.coalesced_.fetch_add(1, std::memory_order_relaxed);
    next_ = descriptor;
    waiting_ = true;
  }

  void OnReadDone(bool received) override {
    const Result<std::string> bytes = service_.validate_request(received, request_);
    request_.Clear();
    if (bytes)
      (service_.*method_)(*bytes, *this);
    else
      finish(rpc_status(bytes.status()));
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
    service_.remove_stream(*this);
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

  ProbeService& service_;
  const Method method_;
  grpc::ByteBuffer request_;
  std::mutex mutex_;
  grpc::ByteBuffer current_, next_;
  bool writing_ = false, waiting_ = false, finished_ = false;
};

/// Receives the calls of all methods that no other service of the server has.
class ProbeService::Dispatcher final : public grpc::CallbackGenericService {
 public:
  explicit Dispatcher(ProbeService& service) : service_(service) {}

  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* context) override {
    static constexpr std::pair<std::string_view, Method> kMethods[] = {
        {"/lightwell.v1.ProbeService/Info", &ProbeService::answer<ProbeCall::info>},
        {"/lightwell.v1.ProbeService/StreamDescriptors", &ProbeService::stream_descriptors},
        {"/lightwell.v1.ProbeService/GetDescriptor", &ProbeService::get_descriptor},
        {"/lightwell.v1.ProbeService/SetConfig", &ProbeService::answer<ProbeCall::set_config>},
        {"/lightwell.v1.ProbeService/ReportLux", &ProbeService::answer<ProbeCall::report_lux>},
        {"/lightwell.v1.ProbeService/GetConfig", &ProbeService::answer<ProbeCall::get_config>}};
    for (const auto& [path, method] : kMethods)
      if (context->method() == path) return new Call(service_, method);
    return CallbackGenericService::CreateReactor(context);  // UNIMPLEMENTED
  }

 private:
  ProbeService& service_;
};

void ProbeService::register_at(grpc::ServerBuilder& builder) {
  // gRPC accepts a generic service only once.
  dispatcher_ = std::make_unique<Dispatcher>(*this);
  builder.RegisterCallbackGenericService(dispatcher_.get());
  builder.RegisterService(kNoHost, &listed_);
}

Result<std::string> ProbeService::validate_request(bool received, const grpc::ByteBuffer& bytes) {
  std::string text;
  std::vector<grpc::Slice> slices;
  if (received && bytes.Length() <= kMaxRequestBytes && bytes.Dump(&slices).ok()) {
    for (const grpc::Slice& s : slices) text.append(reinterpret_cast<const char*>(s.begin()), s.size());
    return text;
  }
  refused_.fetch_add(1, std::memory_order_relaxed);
  return Status(StatusCode::resource_exhausted, "the request is too large or incomplete; the largest has " +
                                                    std::to_string(kMaxRequestBytes) + " bytes");
}

template <class Request>
bool ProbeService::read(const std::string& bytes, Request& request, Call& call) {
  if (request.ParseFromString(bytes)) return true;
  refuse("the request is not a message of proto/lightwell/v1/probe_service.proto", call);
  return false;
}

void ProbeService::refuse(const std::string& why, Call& call) {
  refused_.fetch_add(1, std::memory_order_relaxed);
  call.finish({grpc::StatusCode::INVALID_ARGUMENT, why});
}

void ProbeService::publish(const EncodedDescriptor& descriptor) {
  const grpc::Slice slice(descriptor->data(), descriptor->size());
  const grpc::ByteBuffer buffer(&slice, 1);
  {
    const std::lock_guard lock(newest_mutex_);
    newest_ = buffer;
  }
  const std::lock_guard lock(streams_mutex_);
  for (Call* stream : streams_) stream->enqueue(buffer);
}

LinkCounters ProbeService::counters() const {
  const std::lock_guard lock(streams_mutex_);
  return {.clients = static_cast<std::uint32_t>(streams_.size()),
          .coalesced = coalesced_.load(std::memory_order_relaxed),
          .messages_refused = refused_.load(std::memory_order_relaxed)};
}

void ProbeService::stream_descriptors(const std::string& bytes, Call& call) {
  v1::StreamDescriptorsRequest request;
  if (read(bytes, request, call)) add_stream(call);
}

void ProbeService::get_descriptor(const std::string& bytes, Call& call) {
  v1::GetDescriptorRequest request;
  if (!read(bytes, request, call)) return;
  const std::lock_guard lock(newest_mutex_);
  if (newest_)
    call.respond(*newest_);
  else
    call.finish({grpc::StatusCode::UNAVAILABLE, "no descriptor yet: the camera has not delivered a frame"});
}

template <ProbeCall which>
void ProbeService::answer(const std::string& bytes, Call& call) {
  const Result<std::string> response = answer_probe_call(which, bytes, commands_);
  if (response) {
    const grpc::Slice slice(*response);
    return call.respond(grpc::ByteBuffer(&slice, 1));
  }
  if (response.status().code() == StatusCode::data_loss) return refuse(response.status().message(), call);
  call.finish(rpc_status(response.status()));
}

void ProbeService::add_stream(Call& call) {
  bool closing = false;
  {
    const std::lock_guard lock(streams_mutex_);
    closing = closing_;
    streams_.push_back(&call);
  }
  if (closing) call.finish(shutting_down());
}

void ProbeService::remove_stream(Call& call) {
  const std::lock_guard lock(streams_mutex_);
  std::erase(streams_, &call);
  stream_removed_.notify_all();
}

void ProbeService::close_streams() {
  std::unique_lock lock(streams_mutex_);
  closing_ = true;
  for (Call* stream : streams_) stream->finish(shutting_down());
  // The last write of a client that does not read stays pending in gRPC; the deadline of Server::Shutdown() ends it.
  stream_removed_.wait_for(lock, std::chrono::milliseconds(200), [this] { return streams_.empty(); });
}

}  // namespace lightwell
