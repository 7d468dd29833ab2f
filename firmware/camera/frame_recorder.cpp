#include "camera/frame_recorder.hpp"

namespace lightwell {

Result<std::unique_ptr<FrameRecorder>> FrameRecorder::open(const std::string& path, RecordingHeader header,
                                                           FrameSink& next, int queue) {
  if (queue < 1 || queue > 1024)
    return invalid_argument("recorder.queue must be 1 to 1024, it is " + std::to_string(queue));
  header.kind = RecordingKind::frames;
  Result<RecordWriter> file = RecordWriter::open(path, header);
  if (!file) return file.status();
  return std::unique_ptr<FrameRecorder>(new FrameRecorder(path, std::move(*file), next, queue));
}

FrameRecorder::FrameRecorder(std::string path, RecordWriter file, FrameSink& next, int queue)
    : path_(std::move(path)), file_(std::move(file)), next_(next), copies_(static_cast<std::size_t>(queue)) {
  for (Copy& copy : copies_) {
    copy.record.views.reserve(kMaxLenses);
    free_.push_back(&copy);
  }
  waiting_.reserve(copies_.size());
  thread_ = std::thread([this] { run(); });
}

void FrameRecorder::push(Frame frame) {
  if (Copy* const copy = take_free()) {
    copy->arrival_ns = monotonic_now_ns();
    FrameRecord& record = copy->record;
    record.sequence = frame.info.sequence;
    record.mid_exposure = frame.info.mid_exposure;
    record.exposure_s = frame.info.exposure_s;
    record.gain = frame.info.gain;
    record.row_readout = frame.info.row_readout;
    record.bracket_index = frame.info.bracket_index;
    record.bracket_size = frame.info.bracket_size;
    record.views.clear();
    for (const View& view : frame.views()) {
      std::vector<std::byte>& picture = copy->pictures[record.views.size()];
      picture.assign(view.data.begin(), view.data.end());
      record.views.push_back({view.lens, view.format, view.width, view.height, view.stride, picture});
    }
    const std::lock_guard lock(mutex_);
    waiting_.push_back(copy);
    changed_.notify_one();
  } else {
    ++skipped_;
  }
  next_.push(std::move(frame));
}

Status FrameRecorder::finish() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    changed_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
  return last_error();
}

Status FrameRecorder::last_error() const {
  const std::lock_guard lock(mutex_);
  return error_;
}

FrameRecorder::Copy* FrameRecorder::take_free() {
  const std::lock_guard lock(mutex_);
  if (ending_ || !error_.ok() || free_.empty()) return nullptr;
  Copy* const copy = free_.back();
  free_.pop_back();
  return copy;
}

void FrameRecorder::run() {
  std::vector<std::byte> bytes;
  while (Copy* const copy = next_waiting()) {
    if (last_error().ok()) {
      encode_frame_record(copy->record, bytes);
      const Status written = file_.append(copy->arrival_ns, bytes);
      ++(written.ok() ? recorded_ : skipped_);
      note(written);
    } else {
      ++skipped_;
    }
    const std::lock_guard lock(mutex_);
    free_.push_back(copy);
  }
  if (last_error().ok()) note(file_.flush());
}

/// The oldest copy in the queue; null at the end. Flushes the file before it waits: a power failure loses the queue.
FrameRecorder::Copy* FrameRecorder::next_waiting() {
  std::unique_lock lock(mutex_);
  if (waiting_.empty() && !ending_ && error_.ok()) {
    lock.unlock();
    note(file_.flush());
    lock.lock();
  }
  changed_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
  if (waiting_.empty()) return nullptr;
  Copy* const copy = waiting_.front();
  waiting_.erase(waiting_.begin());
  return copy;
}

void FrameRecorder::note(const Status& written) {
  if (written.ok()) return;
  ++faults_;
  const std::lock_guard lock(mutex_);
  error_ = {written.code(), path_ + ": " + written.message() + "; the recording has ended"};
}

}  // namespace lightwell
