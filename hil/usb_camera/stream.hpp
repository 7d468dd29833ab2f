// The streaming endpoint: starts frames when they are due and sends them in the transfers that the host has queued.
//   Pace, StreamOptions, Faults, TransferStatus, TransferSink, ControlLatency, Stream
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string_view>

#include "usb_camera/frame_log.hpp"
#include "usb_camera/frame_source.hpp"
#include "usb_camera/negotiation.hpp"
#include "usb_camera/payload.hpp"

namespace lightwell::usb_camera {

/// Determines when the next frame is due.
enum class Pace : std::uint8_t {
  rate,   ///< At the negotiated rate, as a sensor. Frames that the host does not fetch in time are dropped and counted.
  guest,  ///< At the negotiated rate at most, and only after the host has fetched the previous frame and queued
          ///< transfers.
  free,   ///< As soon as the host has queued transfers: measures the host's maximum frame rate.
};

struct StreamOptions {
  Pace pace = Pace::rate;
  int control_latency = 2;  ///< In frames; see ControlLatency.
  bool stamp = false;       ///< Embeds the frame's number in the image: stamped().
  int ahead = 8;            ///< Number of frames whose images are ordered before they are due.
};

/// Injected faults. Counts are numbers of frames still to be affected.
struct Faults {
  std::uint64_t tear = 0, shorten = 0, mark = 0, skip = 0;
  std::optional<CameraTime> silent_until;
};

enum class TransferStatus : std::uint8_t { success, cancelled, stalled, refused };

/// Receives completed transfers. Called from within Stream's functions.
class TransferSink {
 public:
  virtual void complete(std::uint64_t id, TransferStatus status, std::span<const std::uint8_t> data) = 0;

 protected:
  ~TransferSink() = default;
};

/// Latency of controls: a sensor applies new settings one or two frames after they are set.
class ControlLatency {
 public:
  /// Settings made while frame n is exposed act from frame n + latency; 0: from frame n.
  explicit ControlLatency(int latency) : latency_(static_cast<std::uint64_t>(latency)) {}

  /// Begins a stream; frame 0 has these settings.
  void start(const SensorSettings& settings);
  /// Sets new settings while frame `exposing` is exposed. Of several during one frame the last one counts.
  void set(const SensorSettings& settings, std::uint64_t exposing);
  /// The settings of a frame, which must not precede a discarded one.
  [[nodiscard]] const SensorSettings& at(std::uint64_t frame) const;
  /// Discards settings that only frames before `frame` need.
  void discard_before(std::uint64_t frame);

 private:
  struct Change {
    std::uint64_t from = 0;
    SensorSettings settings;
  };
  std::uint64_t latency_;
  std::deque<Change> changes_{Change{}};  ///< Never empty.
};

/// Has no thread and no clock; the owner passes the time.
///
/// Frame n is exposed after frame n - 1 is due and until it is due itself; then its transfer begins. It is due one
/// frame interval after the previous one, or later if its exposure takes longer. Numbers start at 0 with each stream. A
/// stream starts with the first transfer after a commit, the clock of Pace::rate when the first image is ready.
class Stream {
 public:
  Stream(const StreamOptions& options, FrameSource& source, FrameLog& log);

  /// To be called after a commit: the next transfer starts a stream.
  [[nodiscard]] Status arm(const NegotiatedFormat& negotiated_format, const SensorSettings& settings);
  /// Stops the stream, as a host does by clearing the endpoint; the committed format stays.
  void stop();
  /// Discards the committed format. Queued transfers are dropped without completion.
  void reset();

  /// Changes the settings; they act on later frames (ControlLatency).
  void set(const SensorSettings& settings);

  /// Queues a transfer of at most `length` bytes; it is completed now or during a run(). Refused if too many are
  /// queued.
  void submit(std::uint64_t id, std::size_t length, TransferSink& sink);
  /// Cancels a transfer and completes it as cancelled. Does nothing if it has been completed.
  void cancel(std::uint64_t id, TransferSink& sink);

  /// Halts the endpoint: every transfer is completed as stalled until clear_halt().
  void halt(TransferSink& sink);
  void clear_halt();
  [[nodiscard]] bool halted() const { return halted_; }

  /// Starts and sends the frames that are due.
  void run(CameraTime now, TransferSink& sink);
  /// The time at which run() must be called even if nothing else happens.
  [[nodiscard]] std::optional<CameraTime> next_due() const;

  [[nodiscard]] Faults& faults() { return faults_; }
  [[nodiscard]] bool streaming() const { return state_ == State::running; }
  [[nodiscard]] const std::optional<NegotiatedFormat>& negotiated_format() const { return negotiated_format_; }
  /// Number of streams since the program began.
  [[nodiscard]] std::uint64_t streams() const { return streams_; }
  [[nodiscard]] std::size_t waiting_transfers() const { return transfers_.size(); }

  /// Limits that no well-behaved host exceeds.
  static constexpr std::size_t kMaxTransfers = 256;
  static constexpr std::size_t kMaxTransferBytes = std::size_t{1} << 20;

 private:
  enum class State : std::uint8_t { idle, armed, starting, running };
  struct Transfer {
    std::uint64_t id;
    std::size_t length;
  };
  /// A frame that is being sent.
  struct Sending {
    FrameRecord record;
    Picture picture;
    PayloadSplitter splitter;
  };

  [[nodiscard]] double interval_s(const SensorSettings& settings) const;
  [[nodiscard]] FrameRecord record(CameraTime due) const;
  [[nodiscard]] std::optional<Outcome> injected_outcome(CameraTime now);
  void drop(FrameRecord record, Outcome outcome);
  void begin(CameraTime due, Picture picture);
  void advance(CameraTime due);
  void order_ahead();
  void start(CameraTime now);
  void run_at_rate(CameraTime now);
  void run_for_guest(CameraTime now);
  void abort_frame();
  void send(CameraTime now, TransferSink& sink);

  StreamOptions options_;
  FrameSource& source_;
  FrameLog& log_;
  ControlLatency settings_;
  SensorSettings latest_;
  double readout_s_ = 0;
  Faults faults_;

  State state_ = State::idle;
  bool halted_ = false;
  std::optional<NegotiatedFormat> negotiated_format_;
  std::deque<Transfer> transfers_;
  std::uint64_t streams_ = 0;
  std::uint64_t next_ = 0;      ///< Number of the frame that is being exposed.
  CameraTime due_;              ///< Time at which that frame is due.
  bool wants_picture_ = false;  ///< The frame is due, but its image is not ready; run() is called when it is.
  bool frame_id_ = false;
  std::optional<Sending> sending_;
  Bytes buffer_;
};

}  // namespace lightwell::usb_camera
