// The streaming endpoint: frames begun at their time, cut into the transfers that the host has queued.
//   Pace, StreamOptions, Faults, TransferStatus, TransferSink, Stream
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
#include "usb_camera/control_latency.hpp"

namespace lightwell::usb_camera {

/// When the next frame is due.
enum class Pace : std::uint8_t {
  rate,   ///< At the agreed rate, as a sensor runs. What the host does not take in time is dropped and counted.
  guest,  ///< Not before the agreed rate says, and not before the host has taken the one before and asks for more.
  free,   ///< As soon as the host asks for more: shows how many frames it can take.
};

struct StreamOptions {
  Pace pace = Pace::rate;
  int control_latency = 2;  ///< ControlLatency's.
  bool stamp = false;       ///< Frames carry their number: frame_stamp.hpp.
  int ahead = 8;            ///< Frames whose pictures are ordered before they are due.
};

/// What is to go wrong. Counts are of frames yet to come.
struct Faults {
  std::uint64_t tear = 0, shorten = 0, mark = 0, skip = 0;
  std::optional<CameraTime> silent_until;
};

enum class TransferStatus : std::uint8_t { success, cancelled, stalled, refused };

/// Where finished transfers go. Called from within Stream's functions.
class TransferSink {
 public:
  virtual void complete(std::uint64_t id, TransferStatus status, std::span<const std::uint8_t> data) = 0;

 protected:
  ~TransferSink() = default;
};

/// No thread and no clock of its own: whoever owns it says what time it is.
///
/// A frame n is being exposed from when frame n - 1 is due until it is due itself; then its transfer begins. It is due
/// one interval after the one before, or later by what its exposure lasts longer. Numbers start at 0 with each stream;
/// a stream starts with the first transfer after a commit, and the clock of Pace::rate with its first picture.
class Stream {
 public:
  Stream(const StreamOptions& options, FrameSource& source, FrameLog& log);

  /// The host has committed: the next transfer starts a stream.
  [[nodiscard]] Status arm(const NegotiatedFormat& negotiated_format, const SensorSettings& settings);
  /// The host has cleared the endpoint, which is how it stops a stream: frames end, the commit stays.
  void stop();
  /// Nothing is committed any more. Transfers that wait are dropped without an answer.
  void reset();

  /// Settings were changed just now.
  void set(const SensorSettings& settings);

  /// A transfer that takes `length` bytes; it is completed now or during a run(). Refused where too many wait.
  void submit(std::uint64_t id, std::size_t length, TransferSink& sink);
  /// The host has given it up; completed as cancelled. Nothing happens where it is done already.
  void cancel(std::uint64_t id, TransferSink& sink);

  /// Every transfer ends in a stall until clear_halt().
  void halt(TransferSink& sink);
  void clear_halt();
  [[nodiscard]] bool halted() const { return halted_; }

  /// Does what is due.
  void run(CameraTime now, TransferSink& sink);
  /// When run() has something to do even if nothing else happens.
  [[nodiscard]] std::optional<CameraTime> next_due() const;

  [[nodiscard]] Faults& faults() { return faults_; }
  [[nodiscard]] bool streaming() const { return state_ == State::running; }
  [[nodiscard]] const std::optional<NegotiatedFormat>& negotiated_format() const { return negotiated_format_; }
  /// Since the program began.
  [[nodiscard]] std::uint64_t streams() const { return streams_; }
  [[nodiscard]] std::size_t waiting_transfers() const { return transfers_.size(); }

  /// A host that queues more at a time is none that behaves.
  static constexpr std::size_t kMaxTransfers = 256;
  static constexpr std::size_t kMaxTransferBytes = std::size_t{1} << 20;

 private:
  enum class State : std::uint8_t { idle, armed, starting, running };
  struct Transfer {
    std::uint64_t id;
    std::size_t length;
  };
  /// A frame on its way.
  struct Sending {
    FrameRecord record;
    Picture picture;
    PayloadSplitter cutter;
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
  std::uint64_t next_ = 0;      ///< The frame that is being exposed.
  CameraTime due_;              ///< When it is due.
  bool wants_picture_ = false;  ///< It is due, and waits for its picture: whoever has it calls run().
  bool frame_id_ = false;
  std::optional<Sending> sending_;
  Bytes buffer_;
};

}  // namespace lightwell::usb_camera
