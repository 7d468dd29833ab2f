#include "link/grpc/probe_service.hpp"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "link/grpc/rpc_status.hpp"

namespace lightwell {
namespace {

/// An :authority that no client sends, because no host can have a name in .invalid (RFC 6761).
constexpr const char* kNoHost = "lightwell.invalid";

}  // namespace

/// A call that reads its one request and passes it to the handler of its method.
class ProbeService::Call final : public ByteCall {
 public:
  Call(ProbeService& service, Method method) : ByteCall(service.streams_), service_(service), method_(method) {
    StartRead(&request_);
  }

  void OnReadDone(bool received) override {
    const Result<std::string> bytes = service_.validate_request(received, request_);
    request_.Clear();
    if (bytes)
      (service_.*method_)(*bytes, *this);
    else
      finish(rpc_status(bytes.status()));
  }

 private:
  ProbeService& service_;
  const Method method_;
  grpc::ByteBuffer request_;
};

/// Receives the calls of all methods that no other service of the server has.
class ProbeService::Dispatcher final : public grpc::CallbackGenericService {
 public:
  explicit Dispatcher(ProbeService& service) : service_(service) {}

  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* context) override {
    static constexpr std::pair<std::string_view, Method> kMethods[] = {
        {"/lightwell.v1.ProbeService/Info", &ProbeService::info},
        {"/lightwell.v1.ProbeService/StreamDescriptors", &ProbeService::stream_descriptors},
        {"/lightwell.v1.ProbeService/GetDescriptor", &ProbeService::get_descriptor},
        {"/lightwell.v1.ProbeService/SetConfig", &ProbeService::set_config},
        {"/lightwell.v1.ProbeService/ReportLux", &ProbeService::report_lux},
        {"/lightwell.v1.ProbeService/GetConfig", &ProbeService::get_config}};
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
  const std::size_t size = received ? bytes.Length() : 0;
  std::string text;
  std::vector<grpc::Slice> slices;
  if (received && size <= kMaxRequestBytes && bytes.Dump(&slices).ok()) {
    for (const grpc::Slice& s : slices) text.append(reinterpret_cast<const char*>(s.begin()), s.size());
    return text;
  }
  refused_.fetch_add(1, std::memory_order_relaxed);
  return Status(StatusCode::resource_exhausted, "the request is too large or incomplete; the largest has " +
                                                    std::to_string(kMaxRequestBytes) + " bytes");
}

template <class Request>
bool ProbeService::read(const std::string& bytes, Request& request, ByteCall& call) {
  if (request.ParseFromString(bytes)) return true;
  refuse("the request is not a message of proto/lightwell/v1/probe_service.proto", call);
  return false;
}

void ProbeService::publish(const EncodedDescriptor& descriptor) {
  const grpc::Slice slice(descriptor->data(), descriptor->size());
  const grpc::ByteBuffer buffer(&slice, 1);
  {
    const std::lock_guard lock(newest_mutex_);
    newest_ = buffer;
  }
  streams_.publish(buffer);
}

LinkCounters ProbeService::counters() const {
  LinkCounters c = streams_.counters();
  c.messages_refused = refused_.load(std::memory_order_relaxed);
  return c;
}

void ProbeService::stream_descriptors(const std::string& bytes, ByteCall& call) {
  v1::StreamDescriptorsRequest request;
  if (read(bytes, request, call)) call.subscribe();
}

void ProbeService::get_descriptor(const std::string& bytes, ByteCall& call) {
  v1::GetDescriptorRequest request;
  if (!read(bytes, request, call)) return;
  const std::lock_guard lock(newest_mutex_);
  if (newest_)
    call.respond(*newest_);
  else
    call.finish({grpc::StatusCode::UNAVAILABLE, "no descriptor yet: the camera has not delivered a frame"});
}

void ProbeService::respond(ProbeCall which, const std::string& bytes, ByteCall& call) {
  const Result<std::string> response = answer_probe_call(which, bytes, commands_);
  if (response) {
    const grpc::Slice slice(*response);
    return call.respond(grpc::ByteBuffer(&slice, 1));
  }
  if (response.status().code() == StatusCode::data_loss) return refuse(response.status().message(), call);
  call.finish(rpc_status(response.status()));
}

void ProbeService::refuse(const std::string& why, ByteCall& call) {
  refused_.fetch_add(1, std::memory_order_relaxed);
  call.finish({grpc::StatusCode::INVALID_ARGUMENT, why});
}

void ProbeService::info(const std::string& bytes, ByteCall& call) { respond(ProbeCall::info, bytes, call); }
void ProbeService::set_config(const std::string& bytes, ByteCall& call) { respond(ProbeCall::set_config, bytes, call); }
void ProbeService::report_lux(const std::string& bytes, ByteCall& call) { respond(ProbeCall::report_lux, bytes, call); }
void ProbeService::get_config(const std::string& bytes, ByteCall& call) { respond(ProbeCall::get_config, bytes, call); }

}  // namespace lightwell
