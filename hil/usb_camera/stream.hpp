// The streaming endpoint: starts frames when they are due, splits them into payloads (UVC 1.1, 2.4.3) and the transfers
// that the host has queued, and logs their outcome.
#pragma once

#include <deque>
#include <memory>

#include <nlohmann/json_fwd.hpp>

#include <lightwell/files.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

#include "usb_camera/controls.hpp"

namespace lightwell::usb_camera {

struct CameraClock {};
/// Nanoseconds of the camera's clock. The program uses CLOCK_MONOTONIC.
using CameraTime = TimePoint<CameraClock>;

/// The camera's clock in payload headers: microseconds modulo 2^32.
[[nodiscard]] std::uint32_t clock_ticks(CameraTime time);
/// The USB frame number in payload headers, derived from the camera's clock instead of the bus: milliseconds modulo
/// 2048.
[[nodiscard]] std::uint16_t start_of_frame(CameraTime time);

struct PayloadFields {
  bool frame_id = false;           ///< Alternates from frame to frame.
  bool error = false;              ///< The frame's ERR bit.
  std::uint32_t presentation = 0;  ///< clock_ticks() of the start of exposure.
};

/// Delivers a frame transfer by transfer. Every payload begins with a new transfer. It ends with a transfer that is
/// shorter than requested, or when it has the negotiated length. A shorter payload that fills its last transfer exactly
/// is therefore followed by an empty transfer.
class PayloadSplitter {
 public:
  /// The frame's memory must outlive this object. `payload_bytes` > kPayloadHeader.
  PayloadSplitter(std::span<const std::byte> frame, std::uint32_t payload_bytes, PayloadFields fields)
      : frame_(frame), payload_bytes_(payload_bytes), fields_(fields) {}

  /// Writes the bytes of a transfer of at most `length` bytes to `out`; `now` becomes the source clock if a payload
  /// begins.
  void fill(std::size_t length, CameraTime now, Bytes& out);

  [[nodiscard]] bool done() const { return sent_ == frame_.size() && !open_; }
  [[nodiscard]] bool begun() const { return begun_; }
  /// Bytes of the frame, without headers, that have been delivered.
  [[nodiscard]] std::size_t sent() const { return sent_; }

 private:
  void open_payload(CameraTime now);

  std::span<const std::byte> frame_;
  std::uint32_t payload_bytes_;
  PayloadFields fields_;
  std::size_t sent_ = 0;
  Bytes header_;                  ///< Remaining bytes of the header.
  std::size_t payload_left_ = 0;  ///< Remaining data bytes of the open payload.
  bool full_size_ = false;        ///< The open payload has the negotiated length.
  bool open_ = false, begun_ = false;
};

/// The immutable bytes of one frame.
using Picture = std::shared_ptr<const std::vector<std::byte>>;

/// A copy of the image that contains the frame's number, for tests that do not evaluate the light.
///   yuyv, nv12   the luma of pixel i of the first row, i from 0 to 15, is 16 d + 8, where d is hexadecimal digit i of
///                the number, least significant first
///   mjpeg        a comment (COM) after the start marker holds the number in eight bytes, least significant first; the
///                pixels do not change
[[nodiscard]] inline Picture stamped(const Picture& picture, Encoding encoding, std::uint64_t number) {
  auto out = std::make_shared<std::vector<std::byte>>(*picture);
  if (encoding == Encoding::mjpeg) {
    // After the two bytes of the start marker, the comment: marker, length including itself, number.
    std::array<std::byte, 12> comment = {std::byte{0xFF}, std::byte{0xFE}, std::byte{0}, std::byte{10}};
    for (std::size_t i = 0; i < 8; ++i) comment[4 + i] = static_cast<std::byte>(number >> (8 * i));
    if (out->size() >= 2) out->insert(out->begin() + 2, comment.begin(), comment.end());
    return out;
  }
  const std::size_t step = encoding == Encoding::yuyv ? 2 : 1;
  for (std::size_t i = 0; i < 16 && i * step < out->size(); ++i)
    (*out)[i * step] = static_cast<std::byte>(16 * (number >> (4 * i) & 0xF) + 8);
  return out;
}

/// Gives the stream its images. scene_source.hpp implements it.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// Sets the format of the images from now on.
  [[nodiscard]] virtual Status configure(const StreamFormat& format) = 0;
  /// Automatic exposure time at gain 1 in seconds. Does not need configure().
  [[nodiscard]] virtual double automatic_exposure_s() const = 0;
  /// From the end of the first row's exposure to the end of the last row's, in the format configured.
  [[nodiscard]] virtual double readout_s() const = 0;
  /// The image of a frame, or nullptr while it is not ready; it is then queued for rendering before all others.
  [[nodiscard]] virtual Picture picture(std::uint64_t number, const SensorSettings& settings) = 0;
  /// Queues an image that will be needed soon.
  virtual void order(std::uint64_t number, const SensorSettings& settings) = 0;
};

enum class Outcome : std::uint8_t {
  sent,        ///< Sent completely.
  torn,        ///< Sent without its middle third (injected fault).
  shortened,   ///< Sent without its last third (injected fault).
  marked,      ///< Sent completely with the error bit (injected fault).
  skipped,     ///< Not sent (injected fault).
  silent,      ///< Not sent, because an injected fault keeps the camera silent.
  busy,        ///< Not sent: the previous frame was still being sent when it was due.
  replaced,    ///< Not sent: the host fetched nothing until the next frame was due.
  unrendered,  ///< Not sent: its image was not rendered in time.
  aborted,     ///< Sent in part: the host, a stall or unplugging ended the stream.
};
inline constexpr std::array<std::string_view, 10> kOutcomes = {"sent",   "torn", "shortened", "marked",     "skipped",
                                                               "silent", "busy", "replaced",  "unrendered", "aborted"};

[[nodiscard]] constexpr std::string_view to_string(Outcome outcome) {
  return kOutcomes[static_cast<std::size_t>(outcome)];
}

struct FrameRecord {
  std::uint64_t stream = 0;  ///< Number of the stream since the program began, from 1.
  std::uint64_t number = 0;  ///< Number of the frame in its stream, from 0, whether it was sent or not.
  CameraTime began;          ///< Start of exposure. clock_ticks() of it is the presentation time in payload headers.
  SensorSettings settings;   ///< Settings of the exposure.
  std::uint64_t bytes = 0;   ///< Size of the image.
  std::uint64_t sent = 0;    ///< Bytes of the image that were sent.
  Outcome outcome = Outcome::sent;
};

/// {"stream":1,"number":0,"began_ns":...,"pts":...,"exposure_s":0.001,"gain":1.0,"kelvin":6500,"bytes":614400,
///  "sent":614400,"outcome":"sent"}
[[nodiscard]] nlohmann::ordered_json json_of(const FrameRecord& record);

/// Log of the outcome of every frame, with which a test compares the frames that arrived.
class FrameLog {
 public:
  /// `keep`: number of latest frames that are kept.
  explicit FrameLog(std::size_t keep = 4096) : keep_(keep) {}

  /// Writes a line of JSON for each frame from now on; overwrites an old file. unavailable: the file cannot be written.
  [[nodiscard]] Status write_to(const std::string& path);

  void add(const FrameRecord& record);
  /// Sets all counts to zero; frame numbers continue.
  void reset_counts() { counts_ = {}; }

  [[nodiscard]] std::uint64_t count(Outcome outcome) const { return counts_[static_cast<std::size_t>(outcome)]; }
  [[nodiscard]] const std::deque<FrameRecord>& records() const { return records_; }

 private:
  std::size_t keep_;
  std::deque<FrameRecord> records_;
  std::array<std::uint64_t, kOutcomes.size()> counts_{};
  FilePointer file_;
};

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
