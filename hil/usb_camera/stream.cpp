#include "usb_camera/stream.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include <nlohmann/json.hpp>

#include "tools/command_line.hpp"

namespace lightwell::usb_camera {
namespace {

// Limit of frames that are logged individually as missed after the machine was suspended.
constexpr int kMaxMissedFrames = 10'000;

// Bits of a payload header (UVC 1.1, 2.4.3.3).
constexpr std::uint8_t kFrameId = 0x01, kEndOfFrame = 0x02, kPresentation = 0x04, kSourceClock = 0x08, kError = 0x40,
                       kEndOfHeader = 0x80;

Duration seconds(double s) { return {std::llround(s * 1e9)}; }

/// Decrements a count of faults; false if it was 0.
bool take(std::uint64_t& count) {
  if (count == 0) return false;
  --count;
  return true;
}

}  // namespace

std::uint32_t clock_ticks(CameraTime time) { return static_cast<std::uint32_t>(time.ns / 1000); }

std::uint16_t start_of_frame(CameraTime time) { return static_cast<std::uint16_t>(time.ns / 1'000'000 & 0x7FF); }

void PayloadSplitter::open_payload(CameraTime now) {
  const std::size_t left = frame_.size() - sent_;
  payload_left_ = std::min(left, payload_bytes_ - kPayloadHeader);
  full_size_ = payload_left_ + kPayloadHeader == payload_bytes_;
  header_.clear();
  put(header_, kPayloadHeader, 1);
  put(header_,
      static_cast<unsigned>(kEndOfHeader | kPresentation | kSourceClock | (fields_.frame_id ? kFrameId : 0) |
                            (fields_.error ? kError : 0) | (payload_left_ == left ? kEndOfFrame : 0)),
      1);
  put(header_, fields_.presentation, 4);
  put(header_, clock_ticks(now), 4);
  put(header_, start_of_frame(now), 2);
  open_ = begun_ = true;
}

void PayloadSplitter::fill(std::size_t length, CameraTime now, Bytes& out) {
  out.clear();
  if (!open_ && sent_ < frame_.size()) open_payload(now);
  const auto of_header = static_cast<std::ptrdiff_t>(std::min(length, header_.size()));
  out.insert(out.end(), header_.begin(), header_.begin() + of_header);
  header_.erase(header_.begin(), header_.begin() + of_header);
  const std::size_t of_data = std::min(length - out.size(), payload_left_);
  const auto* const data = reinterpret_cast<const std::uint8_t*>(frame_.data()) + sent_;
  out.insert(out.end(), data, data + of_data);
  payload_left_ -= of_data;
  sent_ += of_data;
  if (payload_left_ == 0 && header_.empty() && (out.size() < length || full_size_)) open_ = false;
}

nlohmann::ordered_json json_of(const FrameRecord& r) {
  return {{"stream", r.stream},
          {"number", r.number},
          {"began_ns", r.began.ns},
          {"pts", clock_ticks(r.began)},
          {"exposure_s", r.settings.exposure_s},
          {"gain", r.settings.gain},
          {"kelvin", r.settings.kelvin},
          {"bytes", r.bytes},
          {"sent", r.sent},
          {"outcome", to_string(r.outcome)}};
}

Status FrameLog::write_to(const std::string& path) {
  file_.reset(std::fopen(path.c_str(), "w"));
  if (file_ != nullptr) return {};
  return {StatusCode::unavailable, "cannot write the log " + path + ": " + std::strerror(errno)};
}

void FrameLog::add(const FrameRecord& record) {
  ++counts_[static_cast<std::size_t>(record.outcome)];
  records_.push_back(record);
  if (records_.size() > keep_) records_.pop_front();
  if (file_ == nullptr) return;
  std::fputs((json_text(json_of(record)) + "\n").c_str(), file_.get());
  // Flushed per frame, so that other programs can read along and nothing is lost if this one is killed.
  std::fflush(file_.get());
}

void ControlLatency::start(const SensorSettings& settings) { changes_ = {{0, settings}}; }

void ControlLatency::set(const SensorSettings& settings, std::uint64_t exposing) {
  const std::uint64_t from = exposing + latency_;
  if (changes_.back().from == from) {
    changes_.back().settings = settings;
  } else {
    changes_.push_back({from, settings});
  }
}

const SensorSettings& ControlLatency::at(std::uint64_t frame) const {
  for (auto change = changes_.rbegin(); change != changes_.rend(); ++change)
    if (change->from <= frame) return change->settings;
  return changes_.front().settings;
}

void ControlLatency::discard_before(std::uint64_t frame) {
  while (changes_.size() > 1 && changes_[1].from <= frame) changes_.pop_front();
}

Stream::Stream(const StreamOptions& options, FrameSource& source, FrameLog& log)
    : options_(options), source_(source), log_(log), settings_(options.control_latency) {}

Status Stream::arm(const NegotiatedFormat& negotiated_format, const SensorSettings& settings) {
  stop();
  negotiated_format_.reset();
  state_ = State::idle;
  if (Status configured = source_.configure(negotiated_format.format); !configured.ok()) return configured;
  negotiated_format_ = negotiated_format;
  readout_s_ = source_.readout_s();
  latest_ = settings;
  state_ = State::armed;
  return {};
}

void Stream::stop() {
  abort_frame();
  if (negotiated_format_) state_ = State::armed;
}

void Stream::reset() {
  abort_frame();
  state_ = State::idle;
  negotiated_format_.reset();
  transfers_.clear();
  halted_ = false;
}

void Stream::set(const SensorSettings& settings) {
  latest_ = settings;
  if (state_ != State::running) return;
  settings_.set(settings, next_);
  order_ahead();
}

void Stream::submit(std::uint64_t id, std::size_t length, TransferSink& sink) {
  if (halted_) return sink.complete(id, TransferStatus::stalled, {});
  if (transfers_.size() >= kMaxTransfers || length > kMaxTransferBytes)
    return sink.complete(id, TransferStatus::refused, {});
  if (length == 0) return sink.complete(id, TransferStatus::success, {});
  transfers_.push_back({id, length});
}

void Stream::cancel(std::uint64_t id, TransferSink& sink) {
  const auto found =
      std::find_if(transfers_.begin(), transfers_.end(), [&](const Transfer& transfer) { return transfer.id == id; });
  if (found == transfers_.end()) return;
  transfers_.erase(found);
  sink.complete(id, TransferStatus::cancelled, {});
}

void Stream::halt(TransferSink& sink) {
  halted_ = true;
  abort_frame();
  while (!transfers_.empty()) {
    const std::uint64_t id = transfers_.front().id;
    transfers_.pop_front();
    sink.complete(id, TransferStatus::stalled, {});
  }
}

void Stream::clear_halt() {
  halted_ = false;
  stop();
}

double Stream::interval_s(const SensorSettings& settings) const {
  if (options_.pace == Pace::free) return 0;
  // An exposure longer than the frame interval extends the interval.
  return std::max(1.0 / negotiated_format_->format.rate, settings.exposure_s + readout_s_);
}

FrameRecord Stream::record(CameraTime due) const {
  FrameRecord out;
  out.stream = streams_;
  out.number = next_;
  out.settings = settings_.at(next_);
  out.began = due - seconds(out.settings.exposure_s + readout_s_);
  return out;
}

void Stream::drop(FrameRecord record, Outcome outcome) {
  record.outcome = outcome;
  log_.add(record);
}

void Stream::abort_frame() {
  if (!sending_) return;
  sending_->record.sent = sending_->splitter.sent();
  drop(sending_->record, Outcome::aborted);
  sending_.reset();
}

void Stream::start(CameraTime now) {
  ++streams_;
  next_ = 0;
  settings_.start(latest_);
  due_ = now + seconds(interval_s(settings_.at(0)));
  state_ = State::running;
}

void Stream::order_ahead() {
  for (int i = 0; i < options_.ahead; ++i) {
    const std::uint64_t number = next_ + static_cast<std::uint64_t>(i);
    source_.order(number, settings_.at(number));
  }
}

/// The outcome that an injected fault forces on a frame that is due, if there is one.
std::optional<Outcome> Stream::injected_outcome(CameraTime now) {
  if (faults_.silent_until && now < *faults_.silent_until) return Outcome::silent;
  faults_.silent_until.reset();
  if (take(faults_.skip)) return Outcome::skipped;
  return std::nullopt;
}

void Stream::begin(CameraTime due, Picture picture) {
  FrameRecord r = record(due);
  if (options_.stamp) picture = stamped(picture, negotiated_format_->format.encoding, next_);
  r.bytes = picture->size();
  const auto third = static_cast<std::ptrdiff_t>(picture->size() / 3);
  if (take(faults_.tear)) {
    r.outcome = Outcome::torn;
    auto rest = std::make_shared<std::vector<std::byte>>(picture->begin(), picture->begin() + third);
    rest->insert(rest->end(), picture->end() - third, picture->end());
    picture = rest;
  } else if (take(faults_.shorten)) {
    r.outcome = Outcome::shortened;
    picture = std::make_shared<std::vector<std::byte>>(picture->begin(), picture->end() - third);
  } else if (take(faults_.mark)) {
    r.outcome = Outcome::marked;
  }
  frame_id_ = !frame_id_;
  const PayloadFields fields{frame_id_, r.outcome == Outcome::marked, clock_ticks(r.began)};
  const PayloadSplitter splitter(*picture, negotiated_format_->payload_bytes, fields);
  sending_.emplace(Sending{r, std::move(picture), splitter});
}

void Stream::advance(CameraTime due) {
  ++next_;
  settings_.discard_before(next_);
  due_ = due + seconds(interval_s(settings_.at(next_)));
  order_ahead();
}

void Stream::run_at_rate(CameraTime now) {
  for (int missed = 0; now >= due_ && missed < kMaxMissedFrames; ++missed) {
    const FrameRecord frame = record(due_);
    std::optional<Outcome> lost = injected_outcome(now);
    if (!lost && sending_ && sending_->splitter.begun()) lost = Outcome::busy;
    if (!lost) {
      Picture picture = source_.picture(next_, frame.settings);
      if (picture == nullptr) {
        lost = Outcome::unrendered;
      } else {
        if (sending_) {
          drop(sending_->record, Outcome::replaced);
          // The host has not seen the replaced frame, so the next one gets the frame ID that it had.
          frame_id_ = !frame_id_;
          sending_.reset();
        }
        begin(due_, std::move(picture));
      }
    }
    if (lost) drop(frame, *lost);
    advance(due_);
  }
  if (now >= due_) due_ = now;
}

void Stream::run_for_guest(CameraTime now) {
  wants_picture_ = false;
  // Frames of a silent camera are dropped when they are due.
  while (now >= due_ && !sending_ && !transfers_.empty()) {
    if (const std::optional<Outcome> lost = injected_outcome(now)) {
      drop(record(now), *lost);
      advance(now);
      if (options_.pace == Pace::free && *lost == Outcome::silent) due_ = *faults_.silent_until;
      continue;
    }
    Picture picture = source_.picture(next_, settings_.at(next_));
    wants_picture_ = picture == nullptr;
    if (wants_picture_) return;
    begin(now, std::move(picture));
    // If the frame was started promptly, the next one is due one interval after its due time, not after `now`:
    // otherwise the delay of polling would lower the rate.
    const bool prompt = now - due_ < seconds(interval_s(settings_.at(next_)));
    advance(prompt ? due_ : now);
  }
}

void Stream::send(CameraTime now, TransferSink& sink) {
  while (sending_ && !transfers_.empty()) {
    const Transfer transfer = transfers_.front();
    transfers_.pop_front();
    sending_->splitter.fill(transfer.length, now, buffer_);
    if (sending_->splitter.done()) {
      sending_->record.sent = sending_->splitter.sent();
      log_.add(sending_->record);
      sending_.reset();
    }
    sink.complete(transfer.id, TransferStatus::success, buffer_);
    // If the host determines the pace, the next frame may begin in the next transfer.
    if (!sending_ && options_.pace != Pace::rate) run_for_guest(now);
  }
}

void Stream::run(CameraTime now, TransferSink& sink) {
  if (halted_ || !negotiated_format_) return;
  if (state_ == State::armed && !transfers_.empty()) state_ = State::starting;
  if (state_ == State::starting) {
    // The clock starts when the first image is rendered; otherwise the frames before would be counted as unrendered.
    if (source_.picture(0, latest_) == nullptr) return;
    start(now);
    order_ahead();
  }
  if (state_ != State::running) return;
  if (options_.pace == Pace::rate) {
    run_at_rate(now);
  } else {
    run_for_guest(now);
  }
  send(now, sink);
}

std::optional<CameraTime> Stream::next_due() const {
  if (state_ != State::running || halted_) return std::nullopt;
  if (options_.pace == Pace::rate) return due_;
  if (sending_ || transfers_.empty() || wants_picture_) return std::nullopt;
  return due_;
}

}  // namespace lightwell::usb_camera
