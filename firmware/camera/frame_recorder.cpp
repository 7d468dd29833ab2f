#include "camera/frame_recorder.hpp"

#include <array>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <lightwell/frame_record.hpp>

namespace lightwell {
namespace {

/// A frame in memory of its own.
struct Copy {
  std::int64_t arrival_ns = 0;
  FrameRecord record;
  std::array<std::vector<std::byte>, kMaxLenses> pictures;
};

void copy_frame(const Frame& frame, Copy& copy) {
  copy.arrival_ns = monotonic_now_ns();
  FrameRecord& record = copy.record;
  record.sequence = frame.info.sequence;
  record.mid_exposure = frame.info.mid_exposure;
  record.exposure_s = frame.info.exposure_s;
  record.gain = frame.info.gain;
  record.row_readout = frame.info.row_readout;
  record.bracket_index = frame.info.bracket_index;
  record.bracket_size = frame.info.bracket_size;
  record.views.clear();
  for (const View& view : frame.views()) {
    std::vector<std::byte>& picture = copy.pictures[record.views.size()];
    picture.assign(view.data.begin(), view.data.end());
    record.views.push_back({view.lens, view.format, view.width, view.height, view.stride, picture});
  }
}

}  // namespace

Status FrameRecorderOptions::validate() const {
  if (queue >= 1 && queue <= 1024) return {};
  return {StatusCode::invalid_argument, "recorder.queue must be 1 to 1024, it is " + std::to_string(queue)};
}

/// The queue and the thread behind it.
class FrameRecorder::Writer {
 public:
  Writer(std::string path, RecordWriter file, const FrameRecorderOptions& options)
      : path_(std::move(path)), file_(std::move(file)), copies_(static_cast<std::size_t>(options.queue)) {
    for (Copy& copy : copies_) {
      copy.record.views.reserve(kMaxLenses);
      free_.push_back(&copy);
    }
    waiting_.reserve(copies_.size());
    thread_ = std::thread([this] { run(); });
  }
  ~Writer() { (void)finish(); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  void offer(const Frame& frame) {
    Copy* const copy = take_free();
    if (copy == nullptr) {
      ++skipped_;
      return;
    }
    copy_frame(frame, *copy);
    const std::lock_guard lock(mutex_);
    waiting_.push_back(copy);
    changed_.notify_one();
  }

  Status finish() {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
      changed_.notify_one();
    }
    if (thread_.joinable()) thread_.join();
    return last_error();
  }

  [[nodiscard]] Status last_error() const {
    const std::lock_guard lock(mutex_);
    return error_;
  }

  std::atomic<std::uint64_t> recorded_{0}, skipped_{0}, faults_{0};

 private:
  [[nodiscard]] Copy* take_free() {
    const std::lock_guard lock(mutex_);
    if (ending_ || !error_.ok() || free_.empty()) return nullptr;
    Copy* const copy = free_.back();
    free_.pop_back();
    return copy;
  }

  void run() {
    std::vector<std::byte> bytes;
    while (true) {
      Copy* const copy = next_waiting();
      if (copy == nullptr) break;
      if (last_error().ok()) {
        encode_frame_record(copy->record, bytes);
        note(file_.append(copy->arrival_ns, bytes), Counts::frame);
      } else {
        ++skipped_;
      }
      const std::lock_guard lock(mutex_);
      free_.push_back(copy);
    }
    if (last_error().ok()) note(file_.flush(), Counts::nothing);
  }

  /// The oldest copy in the queue; null at the end. Flushes the file before it waits, so that a power failure loses
  /// only frames that were still queued.
  [[nodiscard]] Copy* next_waiting() {
    std::unique_lock lock(mutex_);
    if (waiting_.empty() && !ending_ && error_.ok()) {
      lock.unlock();
      note(file_.flush(), Counts::nothing);
      lock.lock();
    }
    changed_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
    if (waiting_.empty()) return nullptr;
    Copy* const copy = waiting_.front();
    waiting_.erase(waiting_.begin());
    return copy;
  }

  enum class Counts { frame, nothing };
  void note(const Status& written, Counts counts) {
    if (written.ok()) {
      if (counts == Counts::frame) ++recorded_;
      return;
    }
    ++faults_;
    if (counts == Counts::frame) ++skipped_;
    const std::lock_guard lock(mutex_);
    error_ = {written.code(), path_ + ": " + written.message() + "; the recording has ended"};
  }

  const std::string path_;
  RecordWriter file_;
  std::vector<Copy> copies_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Copy*> free_, waiting_;
  bool ending_ = false;
  Status error_;
  std::thread thread_;
};

Result<std::unique_ptr<FrameRecorder>> FrameRecorder::open(const std::string& path, RecordingHeader header,
                                                           FrameSink& next, const FrameRecorderOptions& options) {
  if (Status s = options.validate(); !s.ok()) return s;
  header.kind = RecordingKind::frames;
  Result<RecordWriter> file = RecordWriter::open(path, header);
  if (!file) return file.status();
  return std::unique_ptr<FrameRecorder>(
      new FrameRecorder(next, std::make_unique<Writer>(path, std::move(*file), options)));
}

FrameRecorder::FrameRecorder(FrameSink& next, std::unique_ptr<Writer> writer)
    : next_(next), writer_(std::move(writer)) {}

FrameRecorder::~FrameRecorder() = default;

void FrameRecorder::push(Frame frame) {
  writer_->offer(frame);
  next_.push(std::move(frame));
}

Status FrameRecorder::finish() { return writer_->finish(); }
std::uint64_t FrameRecorder::recorded() const { return writer_->recorded_; }
std::uint64_t FrameRecorder::skipped() const { return writer_->skipped_; }
std::uint64_t FrameRecorder::faults() const { return writer_->faults_; }
Status FrameRecorder::last_error() const { return writer_->last_error(); }

}  // namespace lightwell
