// Messages on a link of plain bytes (USB): each in a frame that a reader finds again after any damage. The format in
// prose: proto/README.md, "Frames".
//   FrameKind, LinkFrame   what a frame carries
//   FrameWriter            payloads -> frames, numbered
//   FrameReader            bytes in any pieces -> whole frames, and counts of what was dropped
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/codec.hpp>

namespace lightwell {

inline constexpr std::uint8_t kFrameVersion = 1;
inline constexpr std::size_t kFrameHeaderBytes = 32;
/// Of a request or a response; a descriptor has its own limit, kMaxDescriptorBytes.
inline constexpr std::size_t kMaxLinkMessageBytes = 8 * 1024;
/// The longest frame, with the byte that may follow it.
inline constexpr std::size_t kMaxFrameBytes = kFrameHeaderBytes + kMaxDescriptorBytes + 1;
/// A frame whose length is a multiple of this is followed by one zero byte. All packet sizes of bulk endpoints (64,
/// 512, 1024) are multiples, so that a transfer of one frame always ends with a short packet.
inline constexpr std::size_t kFrameGranule = 64;

enum class FrameKind : std::uint8_t {
  descriptor = 1,  ///< A LightingDescriptor, to the host.
  request = 2,     ///< A LinkRequest, to the probe.
  response = 3,    ///< A LinkResponse, to the host.
};

struct LinkFrame {
  FrameKind kind = FrameKind::descriptor;
  std::uint32_t session = 0;   ///< The writer's.
  std::uint64_t sequence = 0;  ///< Rises by one with each frame of a session, from 1.
  std::span<const std::byte> payload;
};

/// Makes frames of one direction of a link. One thread at a time.
class FrameWriter {
 public:
  /// session: drawn at random by whoever starts anew, so that a reader tells a probe that restarted from a frame that
  /// was played again.
  explicit FrameWriter(std::uint32_t session) : session_(session) {}

  /// The next frame into `out`, whose memory is used again. invalid_argument for a payload beyond its kind's limit;
  /// no number is spent on it.
  [[nodiscard]] Status write(FrameKind kind, std::span<const std::byte> payload, std::vector<std::byte>& out);

  [[nodiscard]] std::uint32_t session() const { return session_; }
  /// Of the last frame; 0 before the first.
  [[nodiscard]] std::uint64_t sequence() const { return sequence_; }

 private:
  std::uint32_t session_;
  std::uint64_t sequence_ = 0;
};

/// What a reader saw since it was made. Every byte that came is in a frame, a filler, or in `skipped_bytes`.
struct FrameCounters {
  std::uint64_t frames = 0;         ///< Handed on.
  std::uint64_t lost = 0;           ///< Numbers of a session that never came, from holes in the sequence.
  std::uint64_t skipped_bytes = 0;  ///< That were no frame.
  std::uint64_t bad_headers = 0;    ///< A magic number whose header's checksum failed.
  std::uint64_t bad_payloads = 0;   ///< An intact header whose payload's checksum failed.
  std::uint64_t cut_off = 0;        ///< Frames whose end never came before the stream or the transfer ended.
  std::uint64_t oversized = 0;      ///< Intact headers that announce more than their kind may have.
  std::uint64_t unknown = 0;        ///< Intact frames of a version or a kind that this reader does not know.
  std::uint64_t replayed = 0;       ///< Intact frames whose number is not new, or of a session that is over.

  /// Frames and pieces of frames that were refused.
  [[nodiscard]] std::uint64_t refused() const {
    return bad_headers + bad_payloads + cut_off + oversized + unknown + replayed;
  }
};

/// Finds frames in bytes that come in any pieces. Its memory is one longest frame, made once. After damage it looks for
/// the next intact frame at every byte behind the last intact one, so that nothing undamaged is passed over, and
/// nothing is handed on whose checksums or number are wrong. One thread at a time.
class FrameReader {
 public:
  using FrameCallback = std::function<void(const LinkFrame&)>;

  FrameReader();

  /// Calls `take` for each frame that became whole; the payload lives during the call.
  void push(std::span<const std::byte> bytes, const FrameCallback& on_frame);

  /// No frame goes on beyond here: the end of a USB transfer. What is unfinished was cut off, and is looked through for
  /// intact frames at once instead of when more bytes come. A link without such ends need not call it.
  void end_transfer(const FrameCallback& on_frame);

  /// A new stream of bytes, after the link was broken: an unfinished frame was cut off. Sessions and numbers go on, so
  /// that frames lost in between are counted.
  void begin_stream();

  [[nodiscard]] const FrameCounters& counters() const { return counters_; }
  /// Of the session that is read; nothing before the first frame.
  [[nodiscard]] std::optional<std::uint32_t> session() const { return session_; }

 private:
  enum class Search { partial, final };
  enum class Step { advanced, needs_more };
  struct Header;

  void search(Search search, const FrameCallback& on_frame);
  [[nodiscard]] Step step(Search search, const FrameCallback& on_frame);
  /// One byte is no frame's beginning.
  void skip();
  void deliver(const Header& header, std::span<const std::byte> payload, const FrameCallback& on_frame);
  [[nodiscard]] bool is_new(const Header& header);
  void drop_consumed();

  std::vector<std::byte> buffer_;
  std::size_t begin_ = 0, end_ = 0;  ///< Of what is not yet judged, in buffer_.
  bool at_boundary_ = true;          ///< Nothing but whole frames and fillers lie before begin_.
  std::optional<std::uint32_t> session_;
  std::uint64_t sequence_ = 0;
  /// The sessions before, newest last: who plays one of them again is refused.
  std::array<std::uint32_t, 8> ended_{};
  std::size_t ended_count_ = 0;
  FrameCounters counters_;
};

}  // namespace lightwell
