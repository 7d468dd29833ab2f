// Replay of a recording of descriptors and captured planes, through the same DescriptorReceiver as network connections.
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <lightwell/codec.hpp>
#include <lightwell/recording.hpp>

#include "core/source.hpp"

namespace lightwell::core {
namespace {

/// Schedules records and maps mid-exposures to host time, as if the recording happened now at `speed` times the
/// original speed.
class ReplayClock {
 public:
  explicit ReplayClock(double speed) : speed_(speed), start_{monotonic_now_ns()} {}

  [[nodiscard]] HostTime due(std::int64_t record_time_ns) {
    if (speed_ == 0) return start_;
    if (!first_record_ns_) first_record_ns_ = record_time_ns;
    return start_ + scaled(record_time_ns - *first_record_ns_);
  }

  /// The offset between the clocks is chosen so that no descriptor arrives before it was encoded: the shortest
  /// transport so far counts as zero. At speed 0 each record has its own offset.
  [[nodiscard]] HostTime host_time(const CaptureTime& time, HostTime received) {
    const HostTime latest = received - time.encoded_after;
    if (speed_ == 0) return latest;
    const Duration since = scaled(time.mid_exposure.ns);
    const Duration offset{latest.ns - since.ns};
    offset_ = offset_ ? std::min(*offset_, offset) : offset;
    return {since.ns + offset_->ns};
  }

 private:
  [[nodiscard]] Duration scaled(std::int64_t ns) const {
    // At the original speed no digits are lost by conversion to double.
    return {speed_ == 1 ? ns : static_cast<std::int64_t>(static_cast<double>(ns) / speed_)};
  }

  double speed_;
  HostTime start_;
  std::optional<std::int64_t> first_record_ns_;
  std::optional<Duration> offset_;
};

class ReplaySource final : public Source {
 public:
  ReplaySource(RecordReader reader, double speed, PlaneReception plane, DescriptorReceiver& receiver)
      : Source("recording"),
        reader_(std::move(reader)),
        speed_(speed),
        plane_(plane),
        receiver_(receiver),
        thread_([this] { play(); }) {}

  ~ReplaySource() override {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    wake_.notify_all();
    thread_.join();
  }

 private:
  [[nodiscard]] Result<LinkResponse> request(const LinkCommand&) override {
    return Status(StatusCode::failed_precondition,
                  "this is a recording; only a probe at grpc://HOST:PORT or usb: accepts commands");
  }

  void play() {
    receiver_.set_state(LinkState::connected);
    ReplayClock clock(speed_);
    Record record;
    while (reader_.next(record)) {
      if (stopped_before(clock.due(record.time_ns))) return;
      if (record.payload.size() > kMaxDescriptorBytes)
        receiver_.refuse_oversized(record.payload.size());
      else
        deliver(record, clock);
    }
    if (reader_.torn_bytes() > 0)
      receiver_.report_error("the recording is truncated: its last " + std::to_string(reader_.torn_bytes()) +
                             " bytes are not a complete record");
    receiver_.set_state(LinkState::ended);
  }

  void deliver(const Record& record, ReplayClock& clock) {
    const HostTime received{monotonic_now_ns()};
    switch (record.message) {
      case RecordedMessage::descriptor:
        // The probe may have restarted during the recording; a file needs no replay protection.
        receiver_.reset_sequence();
        receiver_.receive(record.payload, received, [&](const CaptureTime& time) {
          return MappedTime{clock.host_time(time, received), {}};
        });
        break;
      case RecordedMessage::plane:
        if (plane_ == PlaneReception::receive) receiver_.receive_plane(record.payload, received);
        break;
      case RecordedMessage::unknown:
        receiver_.refuse("a record that is neither a descriptor nor a message of a plane");
        break;
    }
  }

  /// Sleeps until `due`; true if the destructor was called before.
  bool stopped_before(HostTime due) {
    std::unique_lock lock(mutex_);
    const std::chrono::nanoseconds left(due.ns - monotonic_now_ns());
    return wake_.wait_for(lock, left, [this] { return stopping_; });
  }

  RecordReader reader_;
  const double speed_;
  const PlaneReception plane_;
  DescriptorReceiver& receiver_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::thread thread_;  // last, because it uses all members above
};

}  // namespace

Result<std::unique_ptr<Source>> make_source(const ReplayPath& replay, const ProbeOptions& options,
                                            DescriptorReceiver& receiver) {
  Result<RecordReader> reader = RecordReader::open(replay.path);
  if (!reader.ok()) return reader.status();
  const RecordingHeader& header = reader->header();
  if (header.kind == RecordingKind::frames)
    return invalid_argument(replay.path +
                            " holds a camera's frames, not descriptors; lightwelld plays it as the camera replay:PATH");
  ProbeInfo info;
  info.name = header.probe_name;
  info.version = header.version;
  info.camera = "replay:" + replay.path;
  Record first;
  while (reader->next(first) && first.message == RecordedMessage::plane) {
  }
  if (const Result<Descriptor> descriptor = decode_descriptor(first.payload);
      first.message == RecordedMessage::descriptor && descriptor.ok()) {
    info.id = descriptor->probe_id;
    info.calibration_id = descriptor->calibration_id;
  }
  reader->rewind();
  receiver.describe(info);
  return std::unique_ptr<Source>(
      std::make_unique<ReplaySource>(std::move(*reader), replay.speed, options.plane, receiver));
}

}  // namespace lightwell::core
