// Framing of messages on a byte stream (USB), with resynchronisation after damage. Format: proto/README.md, "Frames".
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/codec.hpp>
#include <lightwell/plane_codec.hpp>

namespace lightwell {

inline constexpr std::uint8_t kFrameVersion = 1;
inline constexpr std::size_t kFrameHeaderBytes = 32;
/// Limit of a request or a response; that of a descriptor is kMaxDescriptorBytes, that of a captured plane's message
/// kMaxPlaneMessageBytes.
inline constexpr std::size_t kMaxLinkMessageBytes = 8 * 1024;
/// The longest frame, including the padding byte that may follow it.
inline constexpr std::size_t kMaxFrameBytes = kFrameHeaderBytes + kMaxDescriptorBytes + 1;
static_assert(kMaxPlaneMessageBytes <= kMaxDescriptorBytes);
/// A frame whose length is a multiple of this is followed by one zero byte. All packet sizes of bulk endpoints (64,
/// 512, 1024) are multiples of it, so that a transfer of one frame always ends with a short packet.
inline constexpr std::size_t kFrameGranule = 64;

enum class FrameKind : std::uint8_t {
  descriptor = 1,  ///< A LightingDescriptor, to the host.
  request = 2,     ///< A LinkRequest, to the probe.
  response = 3,    ///< A LinkResponse, to the host.
  plane = 4,       ///< A PlaneUpdate, to a host that requested them.
};

struct LinkFrame {
  FrameKind kind = FrameKind::descriptor;
  std::uint32_t session = 0;   ///< Identifier of the writer's session.
  std::uint64_t sequence = 0;  ///< Starts at 1 and increases by one with each frame of a session.
  std::span<const std::byte> payload;
};

/// Writes the frames of one direction of a link. One thread at a time.
class FrameWriter {
 public:
  /// session: a random number, new after each restart, so that a reader can distinguish a restarted probe from replayed
  /// frames.
  explicit FrameWriter(std::uint32_t session) : session_(session) {}

  /// Writes the next frame into `out`, whose memory is reused. invalid_argument for a payload that exceeds its kind's
  /// limit; the sequence number then stays as it is.
  [[nodiscard]] Status write(FrameKind kind, std::span<const std::byte> payload, std::vector<std::byte>& out);

  [[nodiscard]] std::uint32_t session() const { return session_; }
  /// Sequence number of the last frame; 0 before the first.
  [[nodiscard]] std::uint64_t sequence() const { return sequence_; }

 private:
  std::uint32_t session_;
  std::uint64_t sequence_ = 0;
};

/// Counters since the construction of a reader. Every received byte belongs to a frame, is padding, or counts in
/// `skipped_bytes`.
struct FrameCounters {
  std::uint64_t frames = 0;         ///< Delivered frames.
  std::uint64_t lost = 0;           ///< Sequence numbers of a session that were never received.
  std::uint64_t skipped_bytes = 0;  ///< Bytes that belong to no frame.
  std::uint64_t bad_headers = 0;    ///< A magic number whose header's checksum failed.
  std::uint64_t bad_payloads = 0;   ///< An intact header whose payload's checksum failed.
  std::uint64_t cut_off = 0;        ///< Frames truncated by the end of the stream or of a transfer.
  std::uint64_t oversized = 0;      ///< Intact headers that announce a payload above the limit of their kind.
  std::uint64_t unknown = 0;        ///< Intact frames of a version or a kind that this reader does not know.
  std::uint64_t replayed = 0;       ///< Intact frames with a sequence number that is not new, or of an ended session.

  /// Frames and parts of frames that were rejected.
  [[nodiscard]] std::uint64_t refused() const {
    return bad_headers + bad_payloads + cut_off + oversized + unknown + replayed;
  }
};

/// Finds frames in bytes that arrive in pieces of any size. It buffers one frame of maximum length, allocated once.
/// After damage it searches for the next intact frame from every byte after the last intact frame, so that it misses no
/// undamaged frame; it delivers no frame with a wrong checksum or sequence number. One thread at a time.
class FrameReader {
 public:
  using FrameCallback = std::function<void(const LinkFrame&)>;

  FrameReader();

  /// Calls `on_frame` for each completed frame; the payload is valid during the call.
  void push(std::span<const std::byte> bytes, const FrameCallback& on_frame);

  /// Marks a point that no frame crosses: the end of a USB transfer. An unfinished frame counts as truncated, and its
  /// bytes are searched for intact frames at once. Need not be called on links without such boundaries.
  void end_transfer(const FrameCallback& on_frame);

  /// Starts a new byte stream after a disconnection: an unfinished frame counts as truncated. Sessions and sequence
  /// numbers continue, so that frames lost in between are counted.
  void begin_stream();

  [[nodiscard]] const FrameCounters& counters() const { return counters_; }
  /// The current session; no value before the first frame.
  [[nodiscard]] std::optional<std::uint32_t> session() const { return session_; }

 private:
  enum class Search { partial, final };
  enum class Step { advanced, needs_more };
  struct Header;

  void search(Search search, const FrameCallback& on_frame);
  [[nodiscard]] Step step(Search search, const FrameCallback& on_frame);
  /// Skips one byte at which no frame begins.
  Step skip();
  /// Counts a frame that is rejected, and skips its first byte.
  Step reject(std::uint64_t& counter);
  void deliver(const Header& header, std::span<const std::byte> payload, const FrameCallback& on_frame);
  [[nodiscard]] bool is_new(const Header& header);
  void drop_consumed();

  std::vector<std::byte> buffer_;
  std::size_t begin_ = 0, end_ = 0;  ///< Range of buffer_ that is not yet parsed.
  bool at_boundary_ = true;          ///< Only whole frames and padding lie before begin_.
  std::optional<std::uint32_t> session_;
  std::uint64_t sequence_ = 0;
  /// Ended sessions, newest last. Their frames are rejected as replays.
  std::array<std::uint32_t, 8> ended_{};
  std::size_t ended_count_ = 0;
  FrameCounters counters_;
};

}  // namespace lightwell
