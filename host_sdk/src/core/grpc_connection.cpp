#include "core/grpc_connection.hpp"

#include <algorithm>
#include <utility>

#include <lightwell/codec.hpp>
#include <lightwell/status_codec.hpp>

#include "core/probe_info.hpp"

namespace lightwell::core {
namespace {

constexpr Duration kInfoPeriod{1'000'000'000};
/// The first round trips follow each other quickly: the very first includes the TCP handshake, and the shortest of
/// several gives a much better clock offset than one.
constexpr Duration kFirstInfoPeriod{20'000'000};
constexpr int kFirstRoundTrips = 8;
/// Round trips before the clock is used for the time stamps of descriptors.
constexpr int kRoundTripsBeforeStream = 2;

constexpr const char* kInfoMethod = "/lightwell.v1.ProbeService/Info";
constexpr const char* kStreamMethod = "/lightwell.v1.ProbeService/StreamDescriptors";

/// A request without fields, whose encoding is empty.
grpc::ByteBuffer nothing() {
  const grpc::Slice empty;
  return {&empty, 1};
}

}  // namespace

GrpcConnection::GrpcConnection(std::shared_ptr<grpc::Channel> channel, const ProbeOptions& options,
                               grpc::CompletionQueue& queue, DescriptorReceiver& receiver)
    : options_(options), queue_(queue), receiver_(receiver), generic_(channel), last_received_{monotonic_now_ns()} {
  request_info();
}

void GrpcConnection::on_event(void* tag, bool ok) {
  const auto op = static_cast<Op>(reinterpret_cast<std::intptr_t>(tag));
  if (op == Op::info)
    on_info(ok);
  else
    on_stream_event(op, ok);
}

HostTime GrpcConnection::next_due() const {
  const HostTime silent = last_received_ + options_.silence_limit;
  return info_pending_ || closing_ ? silent : std::min(silent, next_info_);
}

void GrpcConnection::on_time(HostTime now) {
  if (closing_) return;
  if (now >= last_received_ + options_.silence_limit) {
    close("no data from the probe within silence_limit");
    return;
  }
  if (!info_pending_ && now >= next_info_) request_info();
}

void GrpcConnection::request_info() {
  info_context_ = std::make_unique<grpc::ClientContext>();
  info_context_->set_deadline(deadline_after(options_.connect_timeout));
  info_call_ = generic_.PrepareUnaryCall(info_context_.get(), kInfoMethod, nothing(), &queue_);
  info_pending_ = true;
  info_sent_ = {monotonic_now_ns()};
  info_call_->StartCall();
  info_call_->Finish(&info_response_, &info_status_, tag_of(Op::info));
}

void GrpcConnection::on_info(bool ok) {
  const HostTime now{monotonic_now_ns()};
  info_pending_ = false;
  next_info_ = now + kInfoPeriod;
  if (closing_) return;
  const Result<InfoAnswer> answer =
      ok && info_status_.ok() ? decode_info(bytes_of(info_response_, bytes_)) : status_of(info_status_);
  if (!answer) {
    // With a running stream, a lost response does not end the connection; only silence does.
    if (!streaming_) close(answer.status().message());
    return;
  }
  last_received_ = now;
  clock_.add(info_sent_, answer->clock_now, now);
  ++round_trips_;
  if (round_trips_ < kFirstRoundTrips) next_info_ = now + kFirstInfoPeriod;
  if (round_trips_ < kRoundTripsBeforeStream) {
    request_info();
    return;
  }
  receiver_.describe(probe_info(answer->status, clock_, now));
  if (!streaming_) start_stream();
}

void GrpcConnection::start_stream() {
  streaming_ = true;
  stream_ = generic_.PrepareCall(&stream_context_, kStreamMethod, &queue_);
  stream_pending_ = true;
  stream_->StartCall(tag_of(Op::start));
}

void GrpcConnection::on_stream_event(Op op, bool ok) {
  if (op == Op::finish) {
    stream_pending_ = false;
    // A message above gRPC's own limit (4 MiB) ends the stream before its length is known here.
    const std::string why = stream_status_.error_message();
    if (stream_status_.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED &&
        why.find("larger than max") != std::string::npos)
      receiver_.refuse_oversized(std::size_t{4} << 20);
    close(why.empty() ? "the probe ended the stream" : why);
    return;
  }
  if (op == Op::read && ok) take_message();
  if (!ok || closing_) {
    finish_stream();
    return;
  }
  if (op == Op::start) {
    stream_->Write(nothing(), grpc::WriteOptions().set_last_message(), tag_of(Op::write));
    return;
  }
  if (op == Op::write) receiver_.set_state(LinkState::connected);
  stream_->Read(&message_, tag_of(Op::read));
}

void GrpcConnection::take_message() {
  const HostTime received{monotonic_now_ns()};
  if (message_.Length() > kMaxDescriptorBytes)
    receiver_.refuse_oversized(message_.Length());
  else
    receiver_.receive(bytes_of(message_, bytes_), received,
                      [&](const CaptureTime& time) { return clock_.mapped(time.mid_exposure, received); });
  message_.Clear();
  // Time spent in the application's callback does not count as silence of the probe.
  last_received_ = {monotonic_now_ns()};
}

void GrpcConnection::finish_stream() { stream_->Finish(&stream_status_, tag_of(Op::finish)); }

void GrpcConnection::close(const std::string& error) {
  if (closing_) return;
  closing_ = true;
  if (!error.empty()) receiver_.report_error(error);
  if (info_pending_) info_context_->TryCancel();
  if (stream_pending_) stream_context_.TryCancel();
}

}  // namespace lightwell::core
