#include "link/recordings/probe_recorder.hpp"

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <filesystem>
#include <unistd.h>
#include <utility>

#include <sys/statvfs.h>

#include <lightwell/files.hpp>
#include <lightwell/time.hpp>

namespace lightwell {
namespace {

/// Messages that wait while the disk is slow: two seconds of descriptors.
constexpr std::size_t kMaxQueue = 64;
/// Limit of control(): a disk that takes longer must not hold the thread of a link.
constexpr std::chrono::milliseconds kMaxWait(1000);
/// Between two checks of the disk and of the file.
constexpr std::int64_t kCheckPeriod_ns = 1'000'000'000;
/// Starts at once, and then a second.
constexpr double kStartBurst = 5, kStartRate = 0.1;
constexpr const char* kExtension = ".lwr";

Status exhausted(const std::string& what) { return {StatusCode::resource_exhausted, what}; }

Status unusable(const std::string& what, int error) {
  return {StatusCode::failed_precondition,
          "the probe's folder of recordings " + what + " (" + std::strerror(error) +
              "): the probe's owner must create it, let lightwelld write there, or change recordings.folder"};
}

Status check_free(const std::string& folder, std::uint64_t min_free_bytes) {
  struct statvfs disk {};
  if (::statvfs(folder.c_str(), &disk) != 0) return unusable("cannot be read", errno);
  if (static_cast<std::uint64_t>(disk.f_bavail) * disk.f_frsize >= min_free_bytes) return {};
  return exhausted("less than recordings.min_free_bytes (" + std::to_string(min_free_bytes) +
                   ") is free on the probe's disk; free some of it");
}

std::string time_text(std::time_t now) {
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  (void)std::strftime(text.data(), text.size(), "%Y%m%dT%H%M%SZ", &utc);
  return text.data();
}

/// The message without the folder's path, which no client may see.
Status without_path(const Status& status, const std::string& path, const std::string& name) {
  std::string text = status.message();
  for (std::size_t at; (at = text.find(path)) != std::string::npos;) text.replace(at, path.size(), name);
  return {status.code(), text};
}

}  // namespace

ProbeRecorder::ProbeRecorder(RecordingsConfig config, RecordingHeader header)
    : config_(std::move(config)), header_(std::move(header)), starts_(kStartRate, kStartBurst) {
  queue_.reserve(kMaxQueue);
  writing_.reserve(kMaxQueue);
  thread_ = std::thread([this] { run(); });
}

ProbeRecorder::~ProbeRecorder() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  work_.notify_one();
  thread_.join();
}

Status ProbeRecorder::check_folder() const {
  const FileDescriptor folder(::open(config_.folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder) return unusable("cannot be opened", errno);
  if (::faccessat(folder.get(), ".", W_OK | X_OK, AT_EACCESS) != 0) return unusable("cannot be written", errno);
  const Result<FolderContent> content = survey();
  if (!content) return content.status();
  if (content->files >= config_.max_files)
    return exhausted("there are " + std::to_string(content->files) + " recordings on the probe, and recordings." +
                     "max_files is " + std::to_string(config_.max_files) + "; move some away, or raise it");
  if (content->bytes >= config_.max_bytes)
    return exhausted("the recordings on the probe have " + std::to_string(content->bytes) +
                     " bytes, and recordings.max_bytes is " + std::to_string(config_.max_bytes) +
                     "; move some away, or raise it");
  return check_free(config_.folder, config_.min_free_bytes);
}

Result<ProbeRecorder::FolderContent> ProbeRecorder::survey() const {
  FolderContent content;
  std::error_code error;
  for (std::filesystem::directory_iterator it(config_.folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code gone;  // A file that is removed meanwhile.
    if (it->path().extension() != kExtension || !it->is_regular_file(gone)) continue;
    const std::uintmax_t bytes = it->file_size(gone);
    if (!gone) content.bytes += bytes;
    // A folder that is full anyway is not read to its end.
    if (++content.files >= config_.max_files) break;
  }
  if (error) return unusable("cannot be read", error.value());
  return content;
}

Result<RecordingStatus> ProbeRecorder::control(RecordingAction action) {
  const Status busy(StatusCode::unavailable, "the probe's disk does not respond; see the state of the recording later");
  const auto limit = std::chrono::steady_clock::now() + kMaxWait;
  std::unique_lock lock(mutex_);
  if (!done_.wait_until(lock, limit, [this] { return request_ == nullptr; })) return busy;
  const auto request = std::make_shared<Request>(Request{action, {}});
  request_ = request;
  work_.notify_one();
  if (!done_.wait_until(lock, limit, [&] { return request->outcome.has_value(); })) return busy;
  if (!request->outcome->ok()) return *request->outcome;
  return status_;
}

RecordingStatus ProbeRecorder::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void ProbeRecorder::publish(const EncodedDescriptor& descriptor) {
  enqueue({monotonic_now_ns(), descriptor, nullptr, false});
}

void ProbeRecorder::publish_plane(const std::shared_ptr<const EncodedPlane>& plane) {
  if (header_.kind == RecordingKind::descriptors_and_planes) enqueue({monotonic_now_ns(), nullptr, plane, false});
}

void ProbeRecorder::enqueue(Message message) {
  const std::lock_guard lock(mutex_);
  if (!status_.running) return;
  const bool fits = queue_.size() < kMaxQueue;
  if (message.plane) message.whole_plane = !std::exchange(plane_is_whole_, fits);
  if (!fits) {
    ++status_.lost;
    return;
  }
  queue_.push_back(std::move(message));
  work_.notify_one();
}

void ProbeRecorder::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    // A recording is checked also while nothing is published.
    (void)work_.wait_for(lock, std::chrono::nanoseconds(kCheckPeriod_ns),
                         [this] { return ending_ || request_ || !queue_.empty(); });
    const std::shared_ptr<Request> request = request_;
    const bool ending = ending_;
    std::swap(queue_, writing_);
    lock.unlock();
    if (file_) write_queue();
    writing_.clear();
    const std::optional<Status> outcome = request ? std::optional(execute(request->action)) : std::nullopt;
    if (ending && file_) close_file({});
    lock.lock();
    if (request) {
      request->outcome = outcome;
      request_.reset();
      done_.notify_all();
    }
    if (ending) return;
  }
}

Status ProbeRecorder::execute(RecordingAction action) {
  if (action == RecordingAction::start) return start();
  if (!file_) return {StatusCode::failed_precondition, "no recording runs on the probe"};
  close_file({});
  return {};
}

Status ProbeRecorder::start() {
  if (file_) {
    const std::lock_guard lock(mutex_);
    return {StatusCode::failed_precondition, "a recording runs on the probe already: " + status_.file};
  }
  if (!starts_.take(monotonic_now_ns()))
    return exhausted("recordings were started too often: at most five at once, and then one in ten seconds");
  if (const Status s = check_folder(); !s.ok()) return s;
  const Result<FolderContent> content = survey();
  if (!content) return content.status();
  std::string name;
  if (const Status s = unused_name().assign_to(name); !s.ok()) return s;
  path_ = (std::filesystem::path(config_.folder) / name).string();
  Result<RecordWriter> file = RecordWriter::open(path_, header_);
  if (!file) return without_path(file.status(), path_, name);
  file_.emplace(std::move(*file));
  earlier_bytes_ = content->bytes;
  descriptors_ = 0;
  checked_ns_ = monotonic_now_ns();
  const std::lock_guard lock(mutex_);
  status_ = {true, name, file_->bytes(), 0, 0, {}, status_.faults};
  plane_is_whole_ = false;
  return {};
}

/// The time, and a number that makes it unique, also where the clock is wrong after each start of the board.
Result<std::string> ProbeRecorder::unused_name() {
  const std::string time = time_text(std::time(nullptr));
  for (std::uint32_t i = 0; i <= config_.max_files; ++i) {
    std::array<char, 16> number{};
    (void)std::snprintf(number.data(), number.size(), "-%04u", ++number_);
    const std::string name = time + number.data() + kExtension;
    std::error_code error;
    const auto found = std::filesystem::symlink_status(std::filesystem::path(config_.folder) / name, error);
    if (found.type() == std::filesystem::file_type::not_found) return name;
    if (found.type() == std::filesystem::file_type::none) return unusable("cannot be read", error.value());
  }
  return Status(StatusCode::internal, "no name is left for a recording");
}

void ProbeRecorder::write_queue() {
  Status status;
  for (const Message& message : writing_)
    if (status.ok()) status = write(message);
  // At once, so that a daemon that is killed loses nothing that it wrote.
  if (status.ok() && !writing_.empty()) status = file_->flush();
  if (const std::int64_t now = monotonic_now_ns(); status.ok() && now >= checked_ns_ + kCheckPeriod_ns) {
    checked_ns_ = now;
    status = check_file();
  }
  if (!status.ok()) return close_file(status.message());
  const std::lock_guard lock(mutex_);
  status_.bytes = file_->bytes();
  status_.descriptors = descriptors_;
}

Status ProbeRecorder::write(const Message& message) {
  if (message.descriptor) {
    if (const Status s = append(message.time_ns, *message.descriptor, RecordedMessage::descriptor); !s.ok()) return s;
    ++descriptors_;
    return {};
  }
  for (const std::vector<std::byte>& part : message.whole_plane ? message.plane->whole : message.plane->changes)
    if (const Status s = append(message.time_ns, part, RecordedMessage::plane); !s.ok()) return s;
  return {};
}

Status ProbeRecorder::append(std::int64_t time_ns, std::span<const std::byte> bytes, RecordedMessage kind) {
  // Of a record in the file, at most.
  constexpr std::uint64_t kOverhead = 32;
  if (earlier_bytes_ + file_->bytes() + bytes.size() + kOverhead > config_.max_bytes)
    return exhausted("the recordings on the probe have reached recordings.max_bytes (" +
                     std::to_string(config_.max_bytes) + "); move some away, or raise it");
  return file_->append(time_ns, bytes, kind);
}

Status ProbeRecorder::check_file() const {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path_, error))
    return {StatusCode::data_loss, "the file, or the folder of recordings, was removed"};
  return check_free(config_.folder, config_.min_free_bytes);
}

void ProbeRecorder::close_file(const std::string& end_reason) {
  const std::uint64_t bytes = file_->bytes();
  // Closing writes what a failed flush() left.
  const Status flushed = end_reason.empty() ? file_->flush() : Status();
  file_.reset();
  const std::string& reason = flushed.ok() ? end_reason : flushed.message();
  const std::lock_guard lock(mutex_);
  queue_.clear();
  status_.running = false;
  status_.bytes = bytes;
  status_.descriptors = descriptors_;
  status_.end_reason = reason;
  if (!reason.empty()) ++status_.faults;
}

}  // namespace lightwell
