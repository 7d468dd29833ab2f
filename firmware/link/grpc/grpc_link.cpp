#include "link/grpc/grpc_link.hpp"

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>

#include "lightwell/v1/probe_service.grpc.pb.h"
#include "link/access/link_access.hpp"
#include "link/access/listen_address.hpp"
#include "link/grpc/transport.hpp"
#include "link/plane_queue.hpp"

namespace lightwell {
namespace {

/// An :authority that no client sends, because no host can have a name in .invalid (RFC 6761).
constexpr const char* kNoHost = "lightwell.invalid";

/// Larger requests are refused; the largest valid request has a few hundred bytes.
constexpr std::size_t kMaxRequestBytes = 4096;

grpc::Status shutting_down() { return {grpc::StatusCode::UNAVAILABLE, "the probe is shutting down"}; }

/// ProbeService: requests of clients, descriptor streams with one write in progress and one slot for the newest
/// descriptor each, and streams of captured planes.
///
/// Sends descriptors as the publisher encoded them, and parses requests itself, in order to refuse and count malformed,
/// too large and incomplete ones. A generic service therefore receives all calls as streams of bytes in both
/// directions, which have the same wire format. With the generated service, also with its raw methods, gRPC reads a
/// single request itself and does not report failures.
class ProbeService final {
 public:
  explicit ProbeService(Commands& commands) : commands_(commands) {}

  /// Registers all methods. Call it once for each server, and destroy that server before this object and before the
  /// next call.
  void register_at(grpc::ServerBuilder& builder) {
    // gRPC accepts a generic service only once.
    dispatcher_ = std::make_unique<Dispatcher>(*this);
    builder.RegisterCallbackGenericService(dispatcher_.get());
    builder.RegisterService(kNoHost, &listed_);
  }

  void publish(const EncodedDescriptor& descriptor) {
    const grpc::Slice slice(descriptor->data(), descriptor->size());
    const grpc::ByteBuffer buffer(&slice, 1);
    {
      const std::lock_guard lock(newest_mutex_);
      newest_ = buffer;
    }
    const std::lock_guard lock(streams_mutex_);
    for (Call* stream : streams_) stream->enqueue(buffer);
  }

  void publish_plane(const std::shared_ptr<const EncodedPlane>& plane) {
    const std::lock_guard lock(streams_mutex_);
    newest_plane_ = plane;
    for (Call* stream : plane_streams_) stream->enqueue_plane(plane);
  }

  /// Ends every stream and waits for them, at most 200 ms.
  void close_streams() {
    std::unique_lock lock(streams_mutex_);
    closing_ = true;
    for (const auto* list : {&streams_, &plane_streams_})
      for (Call* stream : *list) stream->finish(shutting_down());
    // The last write of a client that does not read stays pending in gRPC; the deadline of Server::Shutdown() ends it.
    stream_removed_.wait_for(lock, std::chrono::milliseconds(200),
                             [this] { return streams_.empty() && plane_streams_.empty(); });
  }

  /// Number of clients, coalesced descriptors and refused messages.
  [[nodiscard]] LinkCounters counters() const {
    const std::lock_guard lock(streams_mutex_);
    return {.clients = static_cast<std::uint32_t>(streams_.size()),
            .coalesced = coalesced_.load(std::memory_order_relaxed),
            .messages_refused = refused_.load(std::memory_order_relaxed)};
  }

 private:
  class Call;
  /// Handler of a method; receives the bytes of its request.
  using Method = void (ProbeService::*)(const std::string& request, Call& call);

  /// A call with raw bytes as messages. Reads its one request and passes it to the handler of its method. Deletes
  /// itself in OnDone(). gRPC calls the On...() functions from its own threads, never two for the same operation at
  /// once.
  class Call final : public grpc::ServerGenericBidiReactor {
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
      if (descriptor_) service_.coalesced_.fetch_add(1, std::memory_order_relaxed);
      descriptor_ = descriptor;
    }

    /// Sends an update of the plane, or keeps it while the one before is being sent.
    void enqueue_plane(const std::shared_ptr<const EncodedPlane>& plane) {
      const std::lock_guard lock(mutex_);
      if (finished_) return;
      plane_.put(plane);
      if (!writing_) write_next();
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
      } else if (!finished_) {
        write_next();
      }
    }

    void OnCancel() override { finish(grpc::Status::CANCELLED); }

    void OnDone() override {
      service_.remove_stream(*this);
      delete this;
    }

   private:
    void write(const grpc::ByteBuffer& message) {
      current_ = message;
      writing_ = true;
      StartWrite(&current_);
    }

    void write_next() {
      if (descriptor_) {
        write(*descriptor_);
        descriptor_.reset();
      } else if (const EncodedMessage message = plane_.take()) {
        const grpc::Slice slice(message->data(), message->size());
        write({&slice, 1});
      }
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
    grpc::ByteBuffer current_;
    // To be sent after current_: of a stream of descriptors, or of planes.
    std::optional<grpc::ByteBuffer> descriptor_;
    PlaneQueue plane_;
    bool writing_ = false, finished_ = false;
  };

  /// Receives the calls of all methods that no other service of the server has.
  class Dispatcher final : public grpc::CallbackGenericService {
   public:
    explicit Dispatcher(ProbeService& service) : service_(service) {}

    grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* context) override {
      static constexpr std::pair<std::string_view, Method> kMethods[] = {
          {"/lightwell.v1.ProbeService/Info", &ProbeService::answer<ProbeCall::info>},
          {"/lightwell.v1.ProbeService/StreamDescriptors", &ProbeService::stream_descriptors},
          {"/lightwell.v1.ProbeService/GetDescriptor", &ProbeService::get_descriptor},
          {"/lightwell.v1.ProbeService/SetConfig", &ProbeService::answer<ProbeCall::set_config>},
          {"/lightwell.v1.ProbeService/ReportLux", &ProbeService::answer<ProbeCall::report_lux>},
          {"/lightwell.v1.ProbeService/GetConfig", &ProbeService::answer<ProbeCall::get_config>},
          {"/lightwell.v1.ProbeService/ControlRecording", &ProbeService::answer<ProbeCall::control_recording>},
          {"/lightwell.v1.ProbeService/GetCalibration", &ProbeService::answer<ProbeCall::get_calibration>},
          {"/lightwell.v1.ProbeService/StreamPlane", &ProbeService::stream_plane}};
      for (const auto& [path, method] : kMethods)
        if (context->method() == path) return new Call(service_, method);
      return CallbackGenericService::CreateReactor(context);  // UNIMPLEMENTED
    }

   private:
    ProbeService& service_;
  };

  /// The bytes of a complete request of allowed size; otherwise counts it and returns the reason. `received`:
  /// OnReadDone's.
  [[nodiscard]] Result<std::string> validate_request(bool received, const grpc::ByteBuffer& bytes) {
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

  /// Whether `bytes` are such a request; if not, refuses it.
  template <class Request>
  [[nodiscard]] bool check(const std::string& bytes, Call& call) {
    if (Request().ParseFromString(bytes)) return true;
    refuse("the request is not a message of proto/lightwell/v1/probe_service.proto", call);
    return false;
  }

  /// Counts the request and finishes the call with INVALID_ARGUMENT.
  void refuse(const std::string& why, Call& call) {
    refused_.fetch_add(1, std::memory_order_relaxed);
    call.finish({grpc::StatusCode::INVALID_ARGUMENT, why});
  }

  /// Turns the call into a stream: it receives every descriptor, or the newest ones if it is slow.
  void stream_descriptors(const std::string& bytes, Call& call) {
    if (check<v1::StreamDescriptorsRequest>(bytes, call)) add_stream(call, streams_);
  }

  /// Turns the call into a stream: it receives the newest plane at once, and every later update.
  void stream_plane(const std::string& bytes, Call& call) {
    if (check<v1::StreamPlaneRequest>(bytes, call)) add_stream(call, plane_streams_);
  }

  void add_stream(Call& call, std::vector<Call*>& list) {
    bool closing = false;
    {
      const std::lock_guard lock(streams_mutex_);
      closing = closing_;
      list.push_back(&call);
      if (&list == &plane_streams_ && newest_plane_) call.enqueue_plane(newest_plane_);
    }
    if (closing) call.finish(shutting_down());
  }

  void get_descriptor(const std::string& bytes, Call& call) {
    if (!check<v1::GetDescriptorRequest>(bytes, call)) return;
    const std::lock_guard lock(newest_mutex_);
    if (newest_)
      call.respond(*newest_);
    else
      call.finish({grpc::StatusCode::UNAVAILABLE, "no descriptor yet: the camera has not delivered a frame"});
  }

  /// Responds with the result of answer_probe_call().
  template <ProbeCall which>
  void answer(const std::string& bytes, Call& call) {
    const Result<std::string> response = answer_probe_call(which, bytes, commands_);
    if (response) {
      const grpc::Slice slice(*response);
      return call.respond(grpc::ByteBuffer(&slice, 1));
    }
    if (response.status().code() == StatusCode::data_loss) return refuse(response.status().message(), call);
    call.finish(rpc_status(response.status()));
  }

  /// Does nothing for a call that is no stream.
  void remove_stream(Call& call) {
    const std::lock_guard lock(streams_mutex_);
    std::erase(streams_, &call);
    std::erase(plane_streams_, &call);
    stream_removed_.notify_all();
  }

  Commands& commands_;
  std::unique_ptr<grpc::CallbackGenericService> dispatcher_;
  /// Serves no call: reflection lists services with registered methods, which the generic service does not have.
  v1::ProbeService::CallbackService listed_;
  std::atomic<std::uint64_t> refused_{0}, coalesced_{0};
  std::mutex newest_mutex_;
  std::optional<grpc::ByteBuffer> newest_;

  mutable std::mutex streams_mutex_;
  std::condition_variable stream_removed_;
  std::vector<Call*> streams_, plane_streams_;
  std::shared_ptr<const EncodedPlane> newest_plane_;
  bool closing_ = false;
};

class GrpcLink final : public Link {
 public:
  GrpcLink(GrpcConfig config, std::string probe_name, Commands& commands, WallClock clock)
      : config_(std::move(config)), probe_name_(std::move(probe_name)), clock_(std::move(clock)), service_(commands) {}
  ~GrpcLink() override { stop(); }

  Status start() override {
    if (!is_host_and_port(config_.listen_address)) return listen_failure();
    if (const Status s = config_.check_bind_policy(); !s.ok()) return s;
    std::shared_ptr<grpc::ServerCredentials> credentials = grpc::InsecureServerCredentials();
    if (config_.encrypted())
      if (const Status s = make_tls_credentials().assign_to(credentials); !s.ok()) return s;
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort(config_.listen_address, credentials, &port);
    service_.register_at(builder);
    set_limits(builder);
    server_ = builder.BuildAndStart();
    if (!server_ || port == 0) {
      server_.reset();
      return listen_failure();
    }
    port_ = port;
    server_->GetHealthCheckService()->SetServingStatus("lightwell.v1.ProbeService", true);
    return {};
  }

  void publish(const EncodedDescriptor& descriptor) override { service_.publish(descriptor); }

  void publish_plane(const std::shared_ptr<const EncodedPlane>& plane) override { service_.publish_plane(plane); }

  void stop() override {
    if (!server_) return;
    service_.close_streams();
    server_->Shutdown(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
    server_->Wait();
    server_.reset();
  }

  LinkCounters counters() const override {
    LinkCounters c = service_.counters();
    if (!access_) return c;
    c.authentication_failures = access_->authorizer->refused();
    c.client_list_faults = access_->clients->faults();
    return c;
  }

  std::string error_message() const override { return access_ ? access_->error_message() : std::string(); }

  std::string_view name() const override { return "grpc"; }
  std::string address() const override {
    return (config_.encrypted() ? "grpcs://" : "grpc://") +
           config_.listen_address.substr(0, config_.listen_address.rfind(':')) + ":" + std::to_string(port_);
  }

 private:
  [[nodiscard]] Status listen_failure() const {
    return listen_error(config_.listen_address, "grpc.listen_address or --listen");
  }

  Result<std::shared_ptr<grpc::ServerCredentials>> make_tls_credentials() {
    if (const Status s = LinkAccess::open(config_, probe_name_, clock_).assign_to(access_); !s.ok()) return s;
    const bool required = config_.security == LinkSecurity::mutual_tls;
    return reloading_tls_credentials(
        access_->keys, required ? ClientCertificates::required : ClientCertificates::optional, access_->authorizer);
  }

  const GrpcConfig config_;
  const std::string probe_name_;
  const WallClock clock_;
  ProbeService service_;
  std::optional<LinkAccess> access_;  ///< With TLS.
  std::unique_ptr<grpc::Server> server_;
  int port_ = 0;
};

}  // namespace

std::unique_ptr<Link> make_grpc_link(const GrpcConfig& config, std::string_view probe_name, Commands& commands,
                                     WallClock clock) {
  return std::make_unique<GrpcLink>(config, std::string(probe_name), commands, std::move(clock));
}

}  // namespace lightwell
