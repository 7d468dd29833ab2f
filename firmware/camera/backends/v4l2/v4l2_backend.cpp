#include "camera/backends/v4l2/v4l2_backend.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <poll.h>
#include <stop_token>
#include <unistd.h>
#include <utility>

#include <sys/eventfd.h>

#include "camera/backends/v4l2/buffer_pool.hpp"
#include "camera/backends/v4l2/connection.hpp"
#include "camera/backends/v4l2/control_delay.hpp"
#include "camera/backends/v4l2/timing.hpp"

namespace lightwell {
namespace {

using namespace v4l2;

constexpr int kPollPeriod_ms = 250;  ///< Interval of reconnection attempts and of checks for a timeout.

ProbeTime now() { return {monotonic_now_ns()}; }

ProbeTime stamp_of(const v4l2_buffer& buffer) {
  return {buffer.timestamp.tv_sec * 1'000'000'000LL + buffer.timestamp.tv_usec * 1'000LL};
}

class Backend final : public V4l2Camera {
 public:
  explicit Backend(Options options)
      : V4l2Camera("v4l2"), options_(std::move(options)), stop_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}
  ~Backend() override { stop(); }

  [[nodiscard]] Result<CameraInfo> open() override {
    if (pool_) return Status(StatusCode::failed_precondition, "v4l2: is open already");
    if (stop_.get() < 0) return Status(StatusCode::resource_exhausted, "v4l2: no file descriptor is left");
    std::vector<std::string> notes = options_.notes;
    Result<Connection> connection = connect(options_, notes);
    if (!connection) return connection.status();
    // A symbolic link identifies a camera; the number of a node changes.
    std::error_code ignored;
    if (!std::filesystem::is_symlink(options_.path, ignored)) attachment_ = attachment_of(options_.path);
    if (Status s = prepare(*connection, notes); !s.ok()) return s;
    CameraInfo info;
    info.name = device_->card().empty() ? "v4l2:" + options_.path : device_->card();
    info.width = layout_.view_width;
    info.height = layout_.view_height;
    info.format = encoding_->format;
    info.frame_rate = rate_;
    info.exposure_s = exposure_.seconds;
    info.notes = std::move(notes);
    return info;
  }

  [[nodiscard]] Counts counts() const override {
    return {counts_.delivered,      counts_.damaged,       counts_.late,       counts_.no_free_buffer,
            counts_.wrong_exposure, counts_.non_monotonic, counts_.disconnects};
  }

  [[nodiscard]] std::optional<DmaBuffer> dma_buffer(const View& view) const override {
    return pool_ ? pool_->dma_buffer(view.data.data()) : std::nullopt;
  }

 private:
  [[nodiscard]] bool is_open() const override { return pool_.has_value(); }

  [[nodiscard]] Status before_run() override {
    // Detects a device that was lost since the last run, and tries to reconnect.
    const bool fresh = !device_;
    if (fresh)
      if (Status s = connect_again(); !s.ok()) return s;
    int failed = begin_stream();
    if (failed != 0 && !fresh) {
      disconnect();
      if (Status s = connect_again(); !s.ok()) return s;
      failed = begin_stream();
    }
    if (failed != 0) {
      const Status s = device_->error("does not start", failed);
      disconnect();
      return s;
    }
    sequence_.restart();
    last_arrival_ = now();
    return {};
  }

  void after_run() override {
    eventfd_t taken = 0;
    (void)::eventfd_read(stop_.get(), &taken);
    // STREAMOFF returns all buffers from the driver; lent ones keep their content.
    if (device_) (void)device_->stream_off();
  }

  [[nodiscard]] Status prepare(Connection& connection, std::vector<std::string>& notes) {
    encoding_ = connection.encoding;
    layout_ = connection.layout;
    lends_buffers_ = connection.zero_copy;
    rate_ = connection.rate > 0 ? connection.rate : options_.wanted.rate;
    exposure_ = connection.exposure;
    // Keep the exposures in force, so that a reconnected device gets the same ones.
    if (exposure_.control) options_.capture.exposure_s = exposure_.seconds;
    const int bracket = static_cast<int>(exposure_.seconds.size());
    converter_.emplace(*encoding_, layout_);

    int delay = options_.control_delay.value_or(1);
    if (bracket > 1 && !options_.control_delay) {
      const Result<int> measured = measure_control_delay(connection, *converter_, rate_);
      if (!measured) return measured.status();
      delay = *measured;
      notes.push_back("a new exposure shows after " + std::to_string(delay) + " frames, as measured");
    }
    schedule_.emplace(bracket, delay);
    pool_.emplace(required_buffer_count(bracket));
    to_queue_.reserve(BufferPool::kMaxBuffers);
    if (!lends_buffers_) pool_->allocate(layout_.picture_bytes);
    device_.emplace(std::move(connection.device));
    pool_->adopt(std::move(connection.buffers));
    return {};
  }

  [[nodiscard]] Status connect_again() {
    Options options = options_;
    if (attachment_) options.path = node_at(*attachment_).value_or(options_.path);
    std::vector<std::string> reported_before;
    Result<Connection> connection = connect(options, reported_before);
    if (!connection) return connection.status();
    // CameraInfo promised these to the consumers.
    const bool as_before = connection->encoding == encoding_ && connection->layout == layout_ &&
                           connection->zero_copy == lends_buffers_ &&
                           connection->exposure.seconds.size() == exposure_.seconds.size();
    if (!as_before)
      return {StatusCode::unavailable,
              "v4l2: '" + options.path + "' has been reconnected, but delivers another format or size than before"};
    exposure_ = std::move(connection->exposure);
    device_.emplace(std::move(connection->device));
    pool_->adopt(std::move(connection->buffers));
    return {};
  }

  void disconnect() {
    pool_->retire();
    device_.reset();
  }

  [[nodiscard]] int begin_stream() {
    if (exposure_.codes.size() > 1)
      if (const int failed = device_->set_control(exposure_.control->id, exposure_.codes.front()); failed != 0)
        return failed;
    pool_->take_idle(to_queue_);
    for (const int buffer : to_queue_)
      if (const int failed = device_->queue(buffer); failed != 0) return failed;
    if (const int failed = device_->stream_on(); failed != 0) return failed;
    schedule_->restart();
    has_begun_ = false;
    return 0;
  }

  void run(FrameSink& sink, const std::stop_token& stop) override {
    const std::stop_callback wake(stop, [this] { (void)::eventfd_write(stop_.get(), 1); });
    while (true) {
      const PollResult waited = wait_for(device_ ? &*device_ : nullptr, stop_.get(), kPollPeriod_ms);
      if (waited == PollResult::stopped) return;
      if (!device_) {
        try_reopen();
      } else if (waited == PollResult::nothing) {
        if (has_timed_out()) mark_lost();
      } else if (!take_frames(sink, waited == PollResult::broken)) {
        mark_lost();
      }
    }
  }

  void mark_lost() {
    disconnect();
    ++counts_.disconnects;
    state_ = State::lost;
  }

  void try_reopen() {
    if (!connect_again().ok()) return;
    if (begin_stream() != 0) return disconnect();
    const double missed = (now() - last_arrival_).seconds() * rate_;
    sequence_.restart(std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(missed))));
    last_arrival_ = now();
    state_ = State::streaming;
  }

  /// Whether the camera has stopped delivering frames, which some USB hosts and cameras do without an error.
  [[nodiscard]] bool has_timed_out() const {
    const double longest = *std::ranges::max_element(exposure_.seconds);
    // Some cameras need seconds until the first frame.
    const double timeout_s = has_begun_ ? 2 : 5;
    const Duration limit = Duration::from_seconds(timeout_s + 10 * std::max(1 / rate_, longest));
    return now() - last_arrival_ > limit;
  }

  /// False if the device is lost.
  [[nodiscard]] bool take_frames(FrameSink& sink, bool broken) {
    pool_->take_returned(to_queue_);
    for (const int buffer : to_queue_)
      if (device_->queue(buffer) != 0) return false;

    // Deliver only the newest frame: frames that waited for a slow sink are dropped instead of delivered in a burst.
    v4l2_buffer newest{};
    std::optional<std::uint64_t> number;
    int failed = 0;
    for (std::size_t taken = 0; taken < BufferPool::kMaxBuffers; ++taken) {
      v4l2_buffer next;
      failed = device_->dequeue(next);
      if (failed != 0) break;
      if (number) {
        ++counts_.late;
        if (device_->queue(static_cast<int>(newest.index)) != 0) return false;
      }
      newest = next;
      number = sequence_.number(next.sequence);
    }
    if (!number) return failed == EAGAIN && !broken;
    last_arrival_ = now();
    has_begun_ = true;
    return cycle_exposure(newest, *number) && deliver(sink, newest, *number);
  }

  /// False if the device is lost.
  [[nodiscard]] bool cycle_exposure(const v4l2_buffer& newest, std::uint64_t number) {
    const std::optional<ExposureSchedule::Write> write = schedule_->due(number);
    if (!write) return true;
    const int failed =
        device_->set_control(exposure_.control->id, exposure_.codes[static_cast<std::size_t>(write->index)]);
    if (failed == ENODEV) return false;
    pollfd next{device_->descriptor(), POLLIN, 0};
    const bool in_time = failed == 0 && is_punctual(newest, number) && ::poll(&next, 1, 0) == 0;
    schedule_->written(*write, in_time ? ExposureSchedule::Outcome::in_time : ExposureSchedule::Outcome::uncertain);
    return true;
  }

  [[nodiscard]] bool is_punctual(const v4l2_buffer& newest, std::uint64_t number) {
    // The exposure of a frame without an index is unknown, so its latency cannot be compared.
    const std::optional<int> index = schedule_->index_of(number);
    if (!index) return true;
    const Timestamp stamp = validate_timestamp(newest.flags, stamp_of(newest), last_arrival_, oldest_stamp(*index));
    return punctuality_.in_time(*index, now() - stamp.at, Duration::from_seconds(1 / rate_));
  }

  /// False if the device is lost. Buffers that are not lent are requeued at once.
  [[nodiscard]] bool deliver(FrameSink& sink, const v4l2_buffer& buffer, std::uint64_t number) {
    const auto give_back = [&] { return device_->queue(static_cast<int>(buffer.index)) == 0; };
    if (!is_whole(buffer)) {
      ++counts_.damaged;
      return give_back();
    }
    const std::optional<FrameInfo> info = describe_frame(buffer, number);
    if (!info) return give_back();
    if (!pool_->may_lend()) {
      ++counts_.no_free_buffer;
      return give_back();
    }
    Frame frame;
    if (lends_buffers_) {
      frame = pool_->lend_buffer(static_cast<int>(buffer.index));
      frame.add_view(view_of(*encoding_, layout_, bytes_of(buffer)));
    } else {
      std::span<std::byte> memory;
      frame = pool_->lend_picture(memory);
      const bool whole = converter_->convert(bytes_of(buffer), memory);
      if (!give_back()) return false;
      if (!whole) {
        ++counts_.damaged;
        return true;
      }
      frame.add_view(view_of(*encoding_, layout_, memory));
    }
    frame.info = *info;
    frame.info.delivered = now();
    last_mid_ = info->mid_exposure;
    ++counts_.delivered;
    sink.push(std::move(frame));
    return true;
  }

  [[nodiscard]] bool is_whole(const v4l2_buffer& buffer) const {
    return (buffer.flags & V4L2_BUF_FLAG_ERROR) == 0 && buffer.bytesused > 0 && buffer.bytesused >= layout_.bytes;
  }

  /// Empty for a frame whose metadata would be wrong.
  [[nodiscard]] std::optional<FrameInfo> describe_frame(const v4l2_buffer& buffer, std::uint64_t number) {
    const std::optional<int> index = schedule_->index_of(number);
    if (!index) {
      ++counts_.wrong_exposure;
      return std::nullopt;
    }
    FrameInfo info;
    info.sequence = number;
    info.bracket_index = *index;
    info.bracket_size = static_cast<int>(exposure_.seconds.size());
    info.exposure_s = exposure_.seconds[static_cast<std::size_t>(*index)];
    info.row_readout = options_.row_readout;
    const RowTiming rows{layout_.height, encoding_->skip_rows + (layout_.view_height - 1) / 2.0, info.row_readout};
    const Timestamp stamp = validate_timestamp(buffer.flags, stamp_of(buffer), last_arrival_, oldest_stamp(*index));
    info.mid_exposure = mid_exposure(stamp, info.exposure_s, rows);
    // A start-of-exposure timestamp that puts mid-exposure after the arrival is implausible: use the arrival instead.
    if (info.mid_exposure > last_arrival_)
      info.mid_exposure = mid_exposure({last_arrival_, Timestamp::Event::end_of_frame}, info.exposure_s, rows);
    if (info.mid_exposure <= last_mid_) {
      ++counts_.non_monotonic;
      return std::nullopt;
    }
    return info;
  }

  [[nodiscard]] std::span<const std::byte> bytes_of(const v4l2_buffer& buffer) const {
    const std::span<std::byte> all = pool_->buffers()[buffer.index].memory;
    return all.first(std::min<std::size_t>(buffer.bytesused, all.size()));
  }

  /// Largest plausible age of a timestamp on arrival.
  [[nodiscard]] Duration oldest_stamp(int index) const {
    return Duration::from_seconds(1 + exposure_.seconds[static_cast<std::size_t>(index)] + 5 / rate_);
  }

  Options options_;
  const FileDescriptor stop_;

  // Fixed by open().
  const Encoding* encoding_ = nullptr;
  Layout layout_;
  double rate_ = 0;
  bool lends_buffers_ = false;
  std::optional<Attachment> attachment_;
  std::optional<ExposureSchedule> schedule_;
  std::optional<BufferPool> pool_;
  std::optional<Converter> converter_;

  // Owned by the thread while it runs. Without a device the state is lost.
  std::optional<Device> device_;
  ExposureControl exposure_;
  std::vector<int> to_queue_;
  SequenceCounter sequence_;
  LatencyMonitor punctuality_;
  ProbeTime last_arrival_, last_mid_;
  bool has_begun_ = false;  ///< At least one frame has come since streaming began.

  struct {
    std::atomic<std::uint64_t> delivered{0}, damaged{0}, late{0}, no_free_buffer{0}, wrong_exposure{0},
        non_monotonic{0}, disconnects{0};
  } counts_;
};

}  // namespace

Result<std::unique_ptr<CameraBackend>> make_v4l2_backend(const CameraUri& uri, const CameraConfig& config) {
  Result<Options> options = parse_options(uri, config);
  if (!options) return options.status();
  return std::unique_ptr<CameraBackend>(std::make_unique<Backend>(std::move(*options)));
}

}  // namespace lightwell
