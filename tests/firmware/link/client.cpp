#include "firmware/link/client.hpp"

#include <grpc/grpc_security_constants.h>

namespace lightwell::test {
namespace {

void* const kTag = reinterpret_cast<void*>(1);

grpc::ByteBuffer buffer_of(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

std::string text_of_buffer(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  if (!buffer.Dump(&slices).ok()) return {};
  std::string out;
  for (const grpc::Slice& s : slices) out.append(reinterpret_cast<const char*>(s.begin()), s.size());
  return out;
}

std::chrono::system_clock::time_point after(std::chrono::milliseconds timeout) {
  return std::chrono::system_clock::now() + timeout;
}

}  // namespace

std::string host_port(const Link& link) { return link.address().substr(link.address().find("://") + 3); }

std::shared_ptr<grpc::Channel> connect(const Link& link, const std::shared_ptr<grpc::ChannelCredentials>& credentials) {
  grpc::ChannelArguments arguments;
  // The name in every probe's own certificate; unused without TLS.
  arguments.SetSslTargetNameOverride("probe.lightwell.internal");
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // As in the SDK: limits the bytes buffered for a client that does not read; gRPC's default is 16 MiB.
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 8192);
  return grpc::CreateCustomChannel(host_port(link), credentials, arguments);
}

Reply call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method, const std::string& request,
           const std::string& authorization) {
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  grpc::ClientContext context;
  context.set_deadline(after(kTestTimeout));
  if (!authorization.empty()) context.AddMetadata("authorization", authorization);
  const grpc::ByteBuffer sent = buffer_of(request);
  grpc::ByteBuffer received;
  Reply reply;
  const auto unary = stub.PrepareUnaryCall(&context, method, sent, &queue);
  unary->StartCall();
  unary->Finish(&received, &reply.status, kTag);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  if (reply.status.ok()) reply.bytes = text_of_buffer(received);
  if (const auto with = context.auth_context(); with)
    for (const grpc::string_ref& pem : with->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME))
      reply.certificate.assign(pem.data(), pem.size());
  return reply;
}

RawStream::RawStream(std::shared_ptr<grpc::Channel> channel, const std::string& method, const std::string& request)
    : stub_(std::move(channel)) {
  bool ok = false;
  call_ = stub_.PrepareCall(&context_, method, &queue_);
  call_->StartCall(kTag);
  EXPECT_TRUE(await(kTestTimeout, ok)) << "waited for the call to start";
  call_->WriteLast(buffer_of(request), grpc::WriteOptions(), kTag);
  EXPECT_TRUE(await(kTestTimeout, ok)) << "waited for the request to be sent";
}

RawStream::~RawStream() {
  cancel();
  queue_.Shutdown();
  void* tag = nullptr;
  bool ok = false;
  while (queue_.Next(&tag, &ok)) {
  }
}

bool RawStream::await(std::chrono::milliseconds timeout, bool& ok) {
  void* tag = nullptr;
  return queue_.AsyncNext(&tag, &ok, after(timeout)) == grpc::CompletionQueue::GOT_EVENT;
}

std::optional<std::string> RawStream::next(std::chrono::milliseconds timeout) {
  if (ended_) return std::nullopt;
  if (!reading_) call_->Read(&buffer_, kTag);
  bool ok = false;
  reading_ = !await(timeout, ok);
  if (reading_) return std::nullopt;
  ended_ = !ok;
  if (ended_) return std::nullopt;
  return text_of_buffer(buffer_);
}

grpc::Status RawStream::end() {
  const auto last = after(kTestTimeout);
  while (!ended_ && std::chrono::system_clock::now() < last) (void)next();
  if (!ended_) return {grpc::StatusCode::DEADLINE_EXCEEDED, "the stream did not end"};
  grpc::Status status;
  bool ok = false;
  call_->Finish(&status, kTag);
  if (!await(kTestTimeout, ok)) return {grpc::StatusCode::DEADLINE_EXCEEDED, "no status came"};
  return status;
}

}  // namespace lightwell::test
